//! Every combination of ADC codes: a difference at a single one is found.

use codegen::Output;
use policy::{Adc, Policy};
use verify::codes::{Grid, Row};
use verify::{Files, Options};

/// The golden case with two converters of six bits.
fn coarse() -> Policy {
    let mut policy = policy::load(&tests::root().join("tests/golden/cases/adc_mapping/policy.toml")).unwrap();
    for signal in &mut policy.signals {
        signal.adc = Some(Adc {
            gain: 20.0 / 63.0,
            offset: signal.range.low,
            bits: None,
        });
    }
    policy
}

fn compared(policy: &Policy, files: Option<&Files>, compiler: &str) -> Row {
    let grid = Grid::of(policy).unwrap();
    assert_eq!(grid.parts(), 1);
    let options = Options {
        codes: Some((&grid, grid.part(0))),
        generated: files,
        compilers: vec![compiler.to_owned()],
        ..Options::default()
    };
    Row::new(0, &verify::run(policy, options).unwrap())
}

#[test]
fn every_combination_of_codes_is_equal() {
    let policy = coarse();
    let rows = ["gcc", "rustc"].map(|compiler| compared(&policy, None, compiler));
    for row in &rows {
        assert!(row.is_equal() && row.builds >= 2, "{row}");
        assert_eq!(row.combinations, Grid::of(&policy).unwrap().combinations());
    }
    assert_eq!(rows[0].checksum, rows[1].checksum);
}

#[test]
fn a_difference_at_one_combination_is_found_and_named() {
    let policy = coarse();
    let target = targets::find("host").unwrap();
    let mut files = codegen::sources(&policy, target, &[Output::C], None).unwrap().files;
    let text = files.get_mut("adc_mapping.c").unwrap();
    // one of some 4000 measurements gets its neighbour's action
    let function = "void adc_mapping_settle(";
    let at = text.find(function).unwrap();
    let body = at + text[at..].find("{\n").unwrap() + 2;
    text.insert_str(
        body,
        "    if (measured->v_out == 37 && measured->i_out == 12) { index = (index + 1u) % 3u; }\n",
    );
    let row = compared(&policy, Some(&files), "gcc");
    let (v_out, i_out) = (
        row.outcome.contains("; v_out = 37;"),
        row.outcome.contains("; i_out = 12"),
    );
    assert!(row.outcome.contains("in duty_sim") && v_out && i_out, "{row}");
}
