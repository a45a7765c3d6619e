//! Several runs at once, and runs that are killed.

use std::collections::BTreeMap;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use random::{Random, SplitMix};
use tests::tools::listing;
#[cfg(unix)]
use tests::tools::run;

use super::{Desk, contents};

const TEMPORARY: &str = ".policyc-tmp-";

/// Two policies of one name in `policy/` and `other/`, and what each yields.
struct Pair {
    desk: Desk,
    yields: [Vec<(String, Vec<u8>)>; 2],
}

const POLICIES: [&str; 2] = ["policy", "other"];

impl Pair {
    fn new() -> Self {
        let desk = Desk::new("paper");
        tests::tools::copy_folder(&desk.path("policy"), &desk.path("other"));
        desk.edit("other/policy.toml", "duty = [0.3, 0.7]", "duty = [0.35, 0.65]");
        let yields = POLICIES.map(|policy| {
            desk.succeed(&format!("compile {policy} --emit c,rust --out expected-{policy}"));
            contents(&desk.path(&format!("expected-{policy}")))
        });
        assert!(yields[0].iter().zip(&yields[1]).all(|(a, b)| a.0 == b.0 && a.1 != b.1));
        Self { desk, yields }
    }

    fn start(&self, policy: usize) -> Child {
        let mut command = self.desk.command();
        command.args(["compile", POLICIES[policy], "--emit", "c,rust", "--out", "out"]);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    }

    /// The policy that all files of the output folder come from.
    fn whole(&self) -> Option<usize> {
        self.yields
            .iter()
            .position(|expected| *expected == contents(&self.desk.path("out")))
    }

    /// Names of the files that are neither of the old nor of the new policy.
    fn torn(&self) -> Vec<String> {
        let known: BTreeMap<&str, [&[u8]; 2]> = self.yields[0]
            .iter()
            .zip(&self.yields[1])
            .map(|(a, b)| (a.0.as_str(), [&a.1[..], &b.1[..]]))
            .collect();
        let found = contents(&self.desk.path("out"));
        let whole = |name: &str, bytes: &[u8]| known.get(name).is_some_and(|versions| versions.contains(&bytes));
        let torn = found
            .iter()
            .filter(|(name, bytes)| !name.starts_with(TEMPORARY) && !whole(name, bytes));
        let missing = known
            .keys()
            .filter(|name| found.iter().all(|(found, _)| found != *name));
        torn.map(|(name, _)| name.clone())
            .chain(missing.map(|name| format!("{name} is missing")))
            .collect()
    }
}

#[test]
fn eight_runs_at_once_into_one_folder_leave_one_whole_result() {
    let pair = Pair::new();
    let runs: Vec<Child> = (0..8).map(|run| pair.start(run % 2)).collect();
    for mut run in runs {
        assert!(run.wait().unwrap().success());
    }
    assert!(pair.whole().is_some(), "{:?}\n{:?}", pair.torn(), pair.desk.listing());
}

/// Waits for the child as long as `until` says, then kills it; whether it was still at work.
fn kill(mut child: Child, mut until: impl FnMut() -> bool) -> bool {
    let started = Instant::now();
    while !until() && started.elapsed() < Duration::from_secs(20) && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_micros(50));
    }
    child.kill().unwrap();
    child.wait().unwrap().code().is_none()
}

#[test]
fn a_killed_run_leaves_each_file_old_or_new_and_the_next_run_tidies_up() {
    let pair = Pair::new();
    let out = pair.desk.path("out");
    assert!(pair.start(0).wait().unwrap().success());
    let started = Instant::now();
    assert!(pair.start(0).wait().unwrap().success());
    let whole_run = started.elapsed();
    let mut rng = SplitMix::new(1);
    let (mut at_work, mut while_writing) = (0, 0);
    for round in 0..120 {
        let child = pair.start(round % 2);
        let pause = whole_run.mul_f64(rng.unit() * if round % 4 < 2 { 1.0 } else { 0.2 });
        let begun = Instant::now();
        // half of the rounds at any moment, the other half soon after the first temporary file has appeared
        let mut writing_since = None;
        let killed = kill(child, || {
            let writing = round % 4 < 2 || listing(&out).iter().any(|name| name.starts_with(TEMPORARY));
            let since = *writing_since.get_or_insert(begun);
            if !writing {
                writing_since = None;
            } else if round % 4 >= 2 && since == begun {
                writing_since = Some(Instant::now());
            }
            writing && writing_since.is_some_and(|since| since.elapsed() >= pause)
        });
        at_work += usize::from(killed);
        while_writing += usize::from(listing(&out).iter().any(|name| name.starts_with(TEMPORARY)));
        assert_eq!(pair.torn(), [""; 0], "round {round}");
    }
    assert!(
        at_work >= 10 && while_writing >= 3,
        "{at_work} runs killed at work, {while_writing} while writing"
    );
    assert!(pair.start(1).wait().unwrap().success());
    assert_eq!(pair.whole(), Some(1), "{:?}", listing(&out));
}

#[test]
fn what_an_interrupted_run_left_behind_is_removed() {
    let desk = Desk::new("linear");
    std::fs::create_dir(desk.path("out")).unwrap();
    desk.write(&format!("out/{TEMPORARY}123-0"), "half a fi");
    desk.succeed("compile policy --out out");
    assert_eq!(listing(&desk.path("out")), ["linear.c", "linear.h", "manifest.json"]);
}

/// Everything below a folder.
#[cfg(unix)]
fn tree(folder: &std::path::Path) -> String {
    run(std::process::Command::new("find").arg(folder).arg("-mindepth").arg("1")).stdout
}

/// Ctrl-C as soon as something below the temporary folder has `sign` in its path; what is there afterwards.
#[cfg(unix)]
fn interrupted(line: &str, sign: &str) {
    let desk = Desk::new("linear");
    let scratch = desk.path("scratch");
    std::fs::create_dir(&scratch).unwrap();
    let mut command = desk.command();
    command.args(line.split(' ')).env("TMPDIR", &scratch);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let started = Instant::now();
    while !tree(&scratch).contains(sign) {
        assert!(started.elapsed() < Duration::from_secs(300), "{line}: no {sign}");
        assert_eq!(child.try_wait().unwrap(), None, "{line}: ended before {sign}");
        std::thread::sleep(Duration::from_millis(5));
    }
    let ended = super::interrupt(child);
    assert_eq!(ended.status.code(), Some(130), "{line} at {sign}");
    assert_eq!(tree(&scratch), "", "{line} at {sign}");
    // compilers that have outlived the run write nothing either
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(tree(&scratch), "", "{line} at {sign}, later");
}

#[cfg(unix)]
#[test]
fn an_interrupted_verification_leaves_no_temporary_file() {
    for sign in ["/", "policyc_driver.c", "driver.exe"] {
        interrupted("verify policy --steps 4000000000", sign);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_compilation_or_demo_leaves_no_temporary_file() {
    interrupted("compile policy --target cortex-m4f --emit c,rust --out out", "/");
    interrupted("compile policy --emit fmu2 --out out", "/");
    interrupted("demo --steps 4000000000", "driver.exe");
}
