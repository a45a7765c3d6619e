//! `policyc inspect`

use std::fmt::Write;

use codegen::manifest;
use policy::{Activation, Fallback, Interval, Policy};
use serde::Serialize;

use crate::arguments::Inspect;
use crate::{Failure, Outcome, output};
use report::{bytes, grouped};

/// Prints the checked policy.
pub fn run(options: &Inspect) -> Result<Outcome, Failure> {
    let policy = super::load_as(&options.policy, options.format)?;
    if options.json {
        output::say(&serde_json::to_string_pretty(&view(&policy)?)?)?;
    } else {
        output::say(text(&policy)?.trim_end())?;
    }
    if verify::golden_result(&policy).is_some_and(|golden| !golden.passed()) {
        eprintln!("\nDIFFERENT: the network does not give the trainer's golden answers");
        eprintln!("  = hint: {}", verify::MISREAD);
        return Ok(Outcome::Different);
    }
    match verify::decisions(&policy, None).is_some_and(|decisions| !decisions.kept()) {
        false => Ok(Outcome::Done),
        true => {
            eprintln!(
                "\nDIFFERENT: the numeric format changes more of the trainer's decisions than the contract allows"
            );
            Ok(Outcome::Different)
        }
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct View<'p> {
    name: &'p str,
    sample_period: f64,
    numeric_format: policy::NumericFormat,
    signals: &'p [policy::Signal],
    features: &'p [policy::Feature],
    layers: Vec<LayerView<'p>>,
    actions: &'p [policy::Action],
    mapping: Option<policy::Mapping>,
    limits: policy::Limits,
    fallback: policy::Fallback,
    golden_vectors: usize,
    decisions: Option<verify::Decisions>,
    digests: &'p policy::Digests,
    sizes: manifest::Sizes,
    notes: &'p [String],
}

#[derive(Serialize)]
struct LayerView<'p> {
    name: &'p str,
    inputs: usize,
    outputs: usize,
    activation: Activation,
    /// Smallest and largest bound of an output over the box of observations.
    bound: Interval,
}

fn view(policy: &Policy) -> Result<View<'_>, Failure> {
    Ok(View {
        name: &policy.name,
        sample_period: policy.sample_period,
        numeric_format: policy.numeric_format,
        signals: &policy.signals,
        features: &policy.features,
        layers: policy
            .layers
            .iter()
            .map(|layer| LayerView {
                name: &layer.name,
                inputs: layer.inputs,
                outputs: layer.outputs,
                activation: layer.activation,
                bound: hull(&layer.bounds),
            })
            .collect(),
        actions: &policy.actions,
        mapping: policy.mapping,
        limits: policy.limits,
        fallback: policy.fallback,
        golden_vectors: policy.golden.as_ref().map_or(0, |golden| golden.count),
        decisions: verify::decisions(policy, None),
        digests: &policy.digests,
        sizes: manifest::sizes(policy, ::targets::host()),
        notes: &policy.notes,
    })
}

fn hull(bounds: &[Interval]) -> Interval {
    let empty = Interval {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };
    bounds.iter().fold(empty, |all, one| Interval {
        low: all.low.min(one.low),
        high: all.high.max(one.high),
    })
}

fn text(policy: &Policy) -> Result<String, Failure> {
    let mut out = String::new();
    let period = policy.sample_period;
    let sizes = manifest::sizes(policy, ::targets::host());
    writeln!(
        out,
        "{}   one step every {} us ({:.6} kHz), {}",
        policy.name,
        period * 1e6,
        1e-3 / period,
        policy.numeric_format.name()
    )?;
    signals(&mut out, policy)?;
    features(&mut out, policy)?;
    network(&mut out, policy)?;
    actions(&mut out, policy)?;
    limits(&mut out, policy)?;
    writeln!(out, "\nsize")?;
    let macs = grouped(sizes.macs as u64);
    writeln!(
        out,
        "  {macs} MACs per step, {} of tables, {} of state",
        bytes(sizes.table_bytes),
        bytes(sizes.state_bytes)
    )?;
    writeln!(
        out,
        "\ndigests (sha256 of what decides the controller, not of the files)"
    )?;
    writeln!(
        out,
        "  weights  {}\n  contract {}",
        policy.digests.weights, policy.digests.contract
    )?;
    if let Some(mapping) = &policy.digests.mapping {
        writeln!(out, "  mapping  {mapping}")?;
    }
    for note in &policy.notes {
        writeln!(out, "\nnote: {note}")?;
    }
    Ok(out)
}

fn range(interval: Interval) -> String {
    let number = |x: f64| {
        let text = format!("{x:.5}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e7) {
            format!("{x:.4e}")
        } else {
            text.to_owned()
        }
    };
    format!("[{}, {}]", number(interval.low), number(interval.high))
}

fn signals(out: &mut String, policy: &Policy) -> Result<(), Failure> {
    writeln!(out, "\nsignals (plausible range; a sample outside is held)")?;
    let width = policy
        .signals
        .iter()
        .map(|signal| signal.name.len())
        .max()
        .unwrap_or_default();
    for signal in &policy.signals {
        let adc = signal
            .adc
            .map(|adc| format!("   = {} * code + {}", adc.gain, adc.offset))
            .unwrap_or_default();
        writeln!(
            out,
            "  {:width$}  {} {}{adc}",
            signal.name,
            range(signal.range),
            signal.unit
        )?;
    }
    for (name, value) in &policy.parameters {
        writeln!(out, "  {name:width$}  {value} (parameter)")?;
    }
    Ok(())
}

fn features(out: &mut String, policy: &Policy) -> Result<(), Failure> {
    writeln!(
        out,
        "\nobservation (network input order; bound over all plausible measurements)"
    )?;
    for (index, feature) in policy.features.iter().enumerate() {
        let formula = policy::describe::formula(feature, &policy.signals);
        let bound = range(feature.bound);
        match golden_range(policy, index) {
            None => writeln!(out, "  {index:2}  {formula}   in {bound}")?,
            Some(seen) => writeln!(out, "  {index:2}  {formula}   in {bound}, golden in {}", range(seen))?,
        }
    }
    if policy.golden.is_some() {
        writeln!(
            out,
            "  golden vectors begin at the observation: they do not show that these formulas are those of the training"
        )?;
    }
    Ok(())
}

/// Smallest and largest value of a feature in the golden vectors: far from its bound, scale or unit may be wrong.
fn golden_range(policy: &Policy, feature: usize) -> Option<Interval> {
    let golden = policy.golden.as_ref()?;
    let column = golden.observations.iter().skip(feature).step_by(policy.features.len());
    let values = column.map(|x| Interval {
        low: f64::from(*x),
        high: f64::from(*x),
    });
    (golden.count > 0).then(|| hull(&values.collect::<Vec<_>>()))
}

fn network(out: &mut String, policy: &Policy) -> Result<(), Failure> {
    writeln!(out, "\nnetwork")?;
    let width = policy
        .layers
        .iter()
        .map(|layer| layer.name.len())
        .max()
        .unwrap_or_default();
    for layer in &policy.layers {
        let activation = layer.activation.label();
        let (inputs, outputs, bound) = (layer.inputs, layer.outputs, range(hull(&layer.bounds)));
        writeln!(
            out,
            "  {:width$}  {inputs:4} -> {outputs:<4} {activation}, outputs in {bound}",
            layer.name
        )?;
    }
    match verify::golden_result(policy) {
        Some(golden) => {
            writeln!(out, "  {} golden vectors from the trainer: {golden}", golden.vectors)?;
            if let Some(decisions) = verify::decisions(policy, None) {
                for line in verify::text::decisions(policy, &decisions) {
                    writeln!(out, "  {line}")?;
                }
            }
        }
        None => writeln!(out, "  {}", verify::UNPROVEN)?,
    }
    Ok(())
}

fn actions(out: &mut String, policy: &Policy) -> Result<(), Failure> {
    writeln!(out, "\nactions (argmax of Q, lowest index wins)")?;
    let texts = policy
        .actions
        .iter()
        .enumerate()
        .map(|(index, action)| match action.pair {
            None => format!("{index}: {}", action.duty),
            Some(pair) => format!("{index}: {} {:+} * {} = {:.6}", pair.xi, pair.c, pair.phi, action.duty),
        });
    let mut line = String::new();
    for text in texts {
        if line.len() + text.len() > 96 {
            writeln!(out, "  {line}")?;
            line.clear();
        }
        if !line.is_empty() {
            line.push_str("   ");
        }
        line.push_str(&text);
    }
    writeln!(out, "  {line}")?;
    Ok(())
}

fn limits(out: &mut String, policy: &Policy) -> Result<(), Failure> {
    writeln!(out, "\nmapping")?;
    match &policy.mapping {
        None => writeln!(out, "  none: duty = duty of the action")?,
        Some(mapping) => {
            let c = mapping.coefficients;
            let current = &policy.signals[mapping.load_current].name;
            let product = c.r.map(|r| format!(" {r:+} {current} d_sim")).unwrap_or_default();
            writeln!(out, "  duty = {} d_sim {:+} {current} {:+}{product}", c.a, c.b, c.c)?;
            writeln!(
                out,
                "  valid for {current} in {}, d_sim in {}",
                range(mapping.valid_i_out),
                range(mapping.valid_d_sim)
            )?;
            let adjust = [
                ("a", mapping.adjust_a),
                ("b", mapping.adjust_b),
                ("c", mapping.adjust_c),
                ("r", mapping.adjust_r),
            ];
            let shown = adjust.iter().filter(|(name, _)| *name != "r" || c.r.is_some());
            let text: Vec<String> = shown
                .map(|(name, interval)| format!("{name} in {}", range(*interval)))
                .collect();
            writeln!(out, "  at run time {}", text.join(", "))?;
        }
    }
    writeln!(out, "\nlimits")?;
    writeln!(
        out,
        "  duty in {}, {} before the first step",
        range(policy.limits.duty),
        policy.limits.initial_duty
    )?;
    if let Some(slew) = policy.limits.slew {
        writeln!(out, "  at most {slew} per step")?;
    }
    if let Some(soft) = policy.limits.soft_start {
        writeln!(
            out,
            "  soft start: upper limit from {} in {} steps",
            soft.from, soft.steps
        )?;
    }
    let Fallback { duty, hold } = policy.fallback;
    writeln!(out, "  invalid measurement: hold {hold} steps, then duty {duty}")?;
    Ok(())
}
