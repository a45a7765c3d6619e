use std::path::Path; use std::time::Instant;
use diagnose::{columns::Columns, record::*, problem::*, fit::*, noise, attribute::*, drive::Model};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let p = plant::Parameters::from_file(Path::new("examples/blind/plant.toml")).unwrap();
    let recs: Vec<Record> = args.iter().map(|f| Record::open(Path::new(f), &Columns::default(), &p).map_err(|e| println!("{e}")).unwrap()).collect();
    let mut pb = Problem::new(recs, Model::new(&p));
    let t = Instant::now();
    let mut null = State::settle(&pb, &pb.base, &pb.first_starts(), None);
    for _ in 0..2 { pb.sigma = noise::sigma(&pb, &null.residual);
    null = State::settle(&pb, &pb.base, &null.starts, None); }
    println!("sigma {:?} null {:.1} of {} trim {:e} {:?}", pb.sigma, null.chi2, pb.count(), null.starts.trim, t.elapsed());
    let a = attribute(&pb, null, &|s| println!("  {s}"));
    let mut v = a.singles.clone(); v.sort_by(|a,b| a.state.chi2.total_cmp(&b.state.chi2));
    for f in v.iter().take(5) { println!("   {:10.1} {} {:?}", f.state.chi2, a.candidates[f.causes[0]].cause.id, f.values); }
    println!("inflation {:.2} {:?}", a.inflation, t.elapsed());
    if let Some(b) = &a.best {
        println!("BEST {:.1} {:?} {:?} evidence {:?} trim {:e}", b.state.chi2, b.causes.iter().map(|c| a.candidates[*c].cause.id).collect::<Vec<_>>(), b.values, a.evidence, b.state.starts.trim);
        for (n, r) in a.rivals.iter().enumerate() { println!(" rivals of {}: {:?}", n, r.iter().map(|f| (f.state.chi2, f.causes.iter().map(|c| a.candidates[*c].cause.id).collect::<Vec<_>>())).collect::<Vec<_>>()); }
    } else { println!("NONE"); }
    let r = a.best.as_ref().map_or(&a.null.residual, |b| &b.state.residual);
    for (i, rec) in pb.records.iter().enumerate() { for c in 0..4 { let l = noise::left(&noise::channel(&pb, r, i, c)); print!(" {}:{} {:.2} {:.2};", rec.name, CHANNEL_NAMES[c], l.square, l.slow); } println!(); }
}
