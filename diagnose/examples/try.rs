use std::path::Path; use std::time::Instant;
use diagnose::{columns::Columns, record::*, problem::*, fit::*, causes::*, drive::Model};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let p = plant::Parameters::from_file(Path::new("examples/blind/plant.toml")).unwrap();
    let recs: Vec<Record> = args.iter().map(|f| Record::open(Path::new(f), &Columns::default(), &p).map_err(|e| println!("{e}")).unwrap()).collect();
    for r in &recs { println!("{} {} {:?} {:?} lat {:?}", r.name, r.phase, r.segments.len(), r.repairs, r.lattice); }
    let mut pb = Problem::new(recs, Model::new(&p));
    pb.sigma = [0.1,0.05,0.05,0.1];
    let t = Instant::now();
    let s = pb.first_starts();
    let r = pb.residual(&pb.base, &s);
    println!("one sim {:?} chi2 {} n {}", t.elapsed(), dot(&r,&r), pb.count());
    let null = State::settle(&pb, &pb.base, &s, None);
    println!("null chi2 {} of {} {:?}", null.chi2, pb.count(), t.elapsed());
    for (i, rec) in pb.records.iter().enumerate() { for c in 0..4 {
        let v: Vec<f64> = (0..rec.rows()).map(|k| null.residual[pb.offsets[i]+k*4+c]).collect();
        let n = v.iter().filter(|x| **x!=0.0).count();
        println!("  {} {} rms/sigma {:.3} mean {:.3}", rec.name, CHANNEL_NAMES[c], (dot(&v,&v)/n as f64).sqrt(), v.iter().sum::<f64>()/n as f64);
    } }
    let b = pb.basis(&null.model, &null.starts, &null.residual);
    let cands = candidates(&p, &pb.bases);
    let f = Fitter{problem:&pb,candidates:&cands,basis:&b,null:&null};
    if std::env::var("FIT").is_ok() {
    let mut v: Vec<_> = (0..cands.len()).map(|c| { let t = Instant::now(); let fit = f.single(c,&null); (fit, t.elapsed())}).collect();
    v.sort_by(|a,b| a.0.state.chi2.total_cmp(&b.0.state.chi2));
    for (fit,t) in &v { println!("{:10.1} {} {:?} {:?}", fit.state.chi2, cands[fit.causes[0]].cause.id, fit.values, t); }
    }
}
