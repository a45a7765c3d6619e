//! The plant against ngspice, an independent circuit simulator: every effect, sampled values and ripple.

mod cases;
mod compare;
mod netlist;
mod topologies;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Whether the deviations are within their bounds, and a line that says so.
fn judge(case: &cases::Case, found: [f64; 3]) -> (bool, String) {
    // a rounded value may fall to the other side
    let sensors = &case.parameters.sensors;
    let lsb = [sensors.v_out.lsb, sensors.i_l.lsb, 0.0];
    let within = (0..3).all(|n| found[n] <= case.bounds[n] + lsb[n]);
    let [v, i, e] = found;
    let mark = if within { "" } else { "  <-- too far" };
    let text = format!(
        "{v:8.1e} V {i:8.1e} A, extremes {e:8.1e} V; bounds {:?}{mark}",
        case.bounds
    );
    (within, format!("{:36} {text}", case.name))
}

#[test]
fn plant_and_ngspice_agree_on_every_effect() {
    let folder = tempfile::tempdir().unwrap();
    let mut cases = cases::all();
    cases.extend(topologies::all());
    let (next, report) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            let (within, line) = match compare::run(case, folder.path()) {
                Ok(rows) => judge(case, compare::deviations(case, &rows)),
                Err(error) => (false, error),
            };
            report.lock().unwrap().push((within, line));
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(2, |n| n.get()) {
            scope.spawn(work);
        }
    });
    let report = report.into_inner().unwrap();
    let lines: Vec<_> = report.iter().map(|(_, line)| line.as_str()).collect();
    println!("{}", lines.join("\n"));
    assert!(report.iter().all(|(within, _)| *within), "\n{}", lines.join("\n"));
    assert_eq!(report.len(), cases.len());
}
