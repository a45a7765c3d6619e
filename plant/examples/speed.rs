//! Control steps per second on one core: `cargo run --release -p policyc-plant --example speed`. Words behind `--` leave out circuits
//! whose name has none of them.

use std::time::Instant;

use plant::{Batch, Faults, Load, Parameters, Plant, Rectifier};

fn main() -> Result<(), Faults> {
    let sb3 = Parameters::from_toml(
        "sb3-buck12.toml".as_ref(),
        include_str!("../../examples/plants/sb3-buck12.toml"),
    )?;
    let mut esr = Parameters::paper_model();
    esr.capacitor.esr = 0.03;
    let mut cable = esr.clone();
    (cable.cable.inductance, cable.cable.capacitance) = (1e-6, 10e-6);
    let mut short = cable.clone();
    (short.cable.inductance, short.cable.capacitance) = (1e-6, 1e-6);
    let mut bench = esr.clone();
    bench.inductor.dcr = 0.05;
    bench.converter.rectifier = Rectifier::Synchronous;
    bench.switch.dead_time = 5e-7;
    (bench.sensors.v_out.lsb, bench.sensors.i_l.lsb) = (0.05, 0.02);
    single("ideal, 1.5 mF", &Parameters::paper_model(), 200.0)?;
    single("ideal, 150 uF", &Parameters::paper_table(), 200.0)?;
    single("sb3-buck12 (losses)", &sb3, 200.0)?;
    single("ideal, 1.5 mF, DCM", &Parameters::paper_model(), 20.0)?;
    single("with ESR", &esr, 200.0)?;
    single("with ESR, DCR, dead time, sensors", &bench, 200.0)?;
    single("with ESR and cable of 50 kHz", &cable, 200.0)?;
    single("with ESR and cable of 160 kHz", &short, 200.0)?;
    side_by_side("side by side, ideal", &Parameters::paper_model())?;
    side_by_side("side by side, sb3-buck12", &sb3)?;
    side_by_side("side by side, with ESR", &esr)?;
    side_by_side("side by side, with all of that", &bench)
}

fn is_asked(name: &str) -> bool {
    let mut words = std::env::args().skip(1).peekable();
    words.peek().is_none() || words.any(|word| name.contains(&word))
}

/// Fastest of many short runs, so that other programs on the machine do not count.
fn fastest(mut run: impl FnMut() -> u32) -> f64 {
    let rate = |_| {
        let start = Instant::now();
        f64::from(run()) / start.elapsed().as_secs_f64()
    };
    (0..1_000).map(rate).fold(0.0, f64::max)
}

fn single(name: &str, parameters: &Parameters, power: f64) -> Result<(), Faults> {
    if !is_asked(name) {
        return Ok(());
    }
    let mut plant = Plant::new(parameters)?;
    let load = Load::power(power);
    let duty = plant.settle(100.0, &load).duty;
    let rate = fastest(|| {
        // a millisecond: longer runs are interrupted on a machine that is shared
        const STEPS: u32 = 1_000;
        for n in 0..STEPS {
            if n % 100 == 0 {
                plant.reset_at(100.0, 0.5, &load);
            }
            std::hint::black_box(plant.step(duty, &load));
        }
        STEPS
    });
    println!("{name:34} {:8.2} M steps/s", rate * 1e-6);
    Ok(())
}

fn side_by_side(name: &str, parameters: &Parameters) -> Result<(), Faults> {
    if !is_asked(name) {
        return Ok(());
    }
    const COUNT: usize = 32;
    let mut batch = Batch::new(&vec![parameters.clone(); COUNT])?;
    let (duties, loads) = (vec![0.5; COUNT], vec![Load::power(200.0); COUNT]);
    let rate = fastest(|| {
        const STEPS: u32 = 200;
        for n in 0..STEPS {
            if n % 100 == 0 {
                (0..COUNT).for_each(|index| batch.reset_at(index, 100.0, 1.0, &loads[index]));
            }
            batch.step(&duties, &loads);
            for (index, load) in loads.iter().enumerate() {
                std::hint::black_box(batch.measured(index, load));
            }
        }
        STEPS * COUNT as u32
    });
    println!("{name:34} {:8.2} M steps/s", rate * 1e-6);
    Ok(())
}
