use diagnose::{columns::Columns, diagnosis::*, noise, record::*};
use std::path::Path;
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let p = plant::Parameters::from_file(Path::new("examples/blind/plant.toml")).unwrap();
    let (mut tr, mut he) = (vec![], vec![]);
    for f in &args {
        let r = Record::open(Path::new(f), &Columns::default(), &p)
            .map_err(|e| println!("{e}"))
            .unwrap();
        if f.contains("heldout") { he.push(r) } else { tr.push(r) }
    }
    let t = Instant::now();
    let d = diagnose(&p, tr, &he, &|_| ());
    let f = &d.findings;
    println!("{:?} {} {:?}", f.verdict, f.sentence, t.elapsed());
    for c in f.causes.iter().chain(&f.partial) {
        println!("  {} {:?} rivals {:?}", c.id, c.evidence, c.rivals);
    }
    let a = &d.attribution;
    let mut v = a.singles.clone();
    v.sort_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
    print!(
        "  null {:.0} best {:.0} of {}:",
        a.null.chi2,
        a.state().chi2,
        d.problem.count()
    );
    for f in v.iter().take(6) {
        print!(" {:.0} {} {:.4e};", f.state.chi2, a.id(f.causes[0]), f.values[0]);
    }
    println!();
    for h in f.gain.heldout.iter().filter(|h| h.regime == "all") {
        print!(
            " {}:{} {:.4}>{:.4} ({:.3});",
            h.record, h.channel, h.rmse_before, h.rmse_after, h.floor
        );
    }
    println!("\n  noise {:?} remarks {:?}", f.noise.sigma, f.noise.repairs);
    println!(
        "  nd {:?}",
        f.not_detectable.iter().map(|h| (h.id, h.smallest)).collect::<Vec<_>>()
    );
    for e in &f.next_experiments {
        println!("  next {e:?}");
    }
    for (i, rec) in d.problem.records.iter().enumerate() {
        for c in 0..4 {
            let l = noise::left(&noise::channel(&d.problem, &d.attribution.state().residual, i, c));
            print!(" {}:{} {:.2} {:.2};", rec.name, CHANNEL_NAMES[c], l.square, l.slow);
        }
        println!();
    }
}
