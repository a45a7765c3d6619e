//! SARIF 2.1.0 (OASIS), as far as code scanning needs it.

use codegen::TOOL;
use serde_json::{Value, json};

use crate::cases::{Case, Kind};

pub(super) fn text(cases: &[Case]) -> Result<String, serde_json::Error> {
    let rule = |kind: Kind| json!({"id": kind.id(), "shortDescription": {"text": kind.claim()}});
    let log = json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            // policyc's mark, which has to stand near the beginning of a file: this key comes first in every order
            "automationDetails": {"id": "policyc verify/"},
            "tool": {"driver": {
                "name": "policyc",
                "fullName": TOOL,
                "version": env!("CARGO_PKG_VERSION"),
                "rules": Kind::ALL.map(rule),
            }},
            "columnKind": "unicodeCodePoints",
            "results": cases.iter().filter_map(result).collect::<Vec<_>>(),
        }],
    });
    Ok(serde_json::to_string_pretty(&log)? + "\n")
}

fn result(case: &Case) -> Option<Value> {
    let words = [case.name.as_str(), case.failure()?].join(": ");
    Some(json!({
        "ruleId": case.kind.id(),
        "level": "error",
        "message": {"text": words},
        "locations": [{"physicalLocation": {
            "artifactLocation": {"uri": uri(&case.file)},
            "region": {"startLine": case.line},
        }}],
    }))
}

/// A path as a reference of RFC 3986: relative to the checkout, or of this machine.
fn uri(path: &str) -> String {
    let mut out = String::from(if path.starts_with('/') { "file://" } else { "" });
    for byte in path.strip_prefix("./").unwrap_or(path).bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' | b'~' => out.push(char::from(byte)),
            other => out.push_str(&format!("%{other:02X}")),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::tests::cases;

    #[test]
    fn a_failed_case_is_a_result_with_uri_and_line_and_others_are_none() {
        let log: Value = serde_json::from_str(&text(&cases()).unwrap()).unwrap();
        let results = log["runs"][0]["results"].as_array().unwrap();
        assert_eq!(results.len(), 1);
        let place = &results[0]["locations"][0]["physicalLocation"];
        assert_eq!(place["artifactLocation"]["uri"], "gen%2C%20new/a%20b.c");
        assert_eq!(place["region"]["startLine"], 7);
        assert_eq!(results[0]["ruleId"], log["runs"][0]["tool"]["driver"]["rules"][0]["id"]);
    }

    #[test]
    fn paths_become_references() {
        assert_eq!(uri("./out/a.c"), "out/a.c");
        assert_eq!(uri("/home/ü/a.c"), "file:///home/%C3%BC/a.c");
    }
}
