//! The page of `policyc compile`: what a step needs, whether it fits, the layers, and which line of the code a line of the contract
//! became. All of it is known to the command; nothing is computed for the page.

use codegen::manifest::Sizes;
use policy::{DutyPath, Policy};
use report::{Axis, BarChart, BarPanel, Cell, Page, ReportError, Section, Table, Verdict, bytes, grouped};
use targets::TargetSpec;
use verify::Files;
use verify::budget::{Budget, Clock, Fit};
use verify::costs::StepCosts;

/// What the page is made of.
pub struct Shown<'a> {
    pub policy: &'a Policy,
    pub target: &'a TargetSpec,
    pub sizes: &'a Sizes,
    /// The contract's text and the path that the user gave.
    pub contract: (&'a str, &'a str),
    pub files: &'a Files,
    /// Names and lengths of all that is written.
    pub written: Vec<(String, usize)>,
    pub costs: &'a StepCosts,
    /// As the command says them.
    pub cost_texts: &'a [String],
    pub clock: Option<Clock>,
    pub budget: &'a [String],
    pub notes: &'a [String],
}

/// The page as HTML.
///
/// # Errors
/// None in practice: a table whose rows do not fit its columns.
pub fn page(shown: &Shown<'_>) -> Result<String, ReportError> {
    let Shown { policy, target, .. } = shown;
    let (verdict, word, sentence) = verdict(shown);
    let mut page = Page::new(format!("{}: code for {}", policy.name, target.name)).verdict_as(verdict, word, sentence);
    page = page.section(needs(shown)).section(layers(policy)).section(lines(shown));
    page.section(files(shown)).html()
}

fn verdict(shown: &Shown<'_>) -> (Verdict, &'static str, String) {
    let Sizes {
        macs,
        table_bytes,
        state_bytes,
        ..
    } = shown.sizes;
    let sizes = format!(
        "{} in {}: {} multiply-accumulates a step, {} of tables, {} of state.",
        shown.policy.name,
        shown.policy.numeric_format.name(),
        grouped(*macs as u64),
        bytes(*table_bytes),
        bytes(*state_bytes)
    );
    // the build that is done first decides: who is in a hurry takes that one
    let budget = |clock| {
        shown
            .costs
            .measured()
            .filter_map(move |costs| Budget::of(costs, clock, shown.policy.sample_period))
    };
    let soonest = shown
        .clock
        .and_then(|clock| budget(clock).min_by(|a, b| a.share.1.total_cmp(&b.share.1)));
    let Some(budget) = soonest else {
        return (Verdict::Note, "", sizes);
    };
    let (least, most) = budget.share;
    let share = format!(
        "A step takes {:.0} to {:.0} % of {} at {}, by a model of the processor.",
        100.0 * least,
        100.0 * most,
        match budget.part {
            part if part < 1.0 => "what is left of its period behind the sample",
            _ => "its period",
        },
        Clock::shown(budget.clock_hz)
    );
    let (verdict, word) = match budget.fit {
        Fit::Met => (Verdict::Pass, "fits"),
        Fit::Doubtful => (Verdict::Warn, "may not fit"),
        Fit::Missed => (Verdict::Fail, "too slow"),
    };
    (verdict, word, format!("{share} {sizes}"))
}

/// Memory and time of a step, as far as they could be found out here.
fn needs(shown: &Shown<'_>) -> Section {
    let sizes = shown.sizes;
    let mut section = Section::new("What it needs").pairs([
        ("control period", report::quantity(shown.policy.sample_period, "s", 3)),
        ("tables, in flash", bytes(sizes.table_bytes)),
        ("state, in RAM", bytes(sizes.state_bytes)),
        ("multiply-accumulates a step", grouped(sizes.macs as u64)),
    ]);
    let measured: Vec<_> = shown.costs.measured().collect();
    if !measured.is_empty() {
        let mut table = Table::new(
            "Each build under the target's emulator: instructions and memory are counted, cycles are a model",
        )
        .text("build")
        .text("flash")
        .text("static RAM")
        .text("stack")
        .text("instructions")
        .text("model cycles");
        for costs in &measured {
            let from_to = |(least, most): (u64, u64)| match least == most {
                true => grouped(most),
                false => format!("{} to {}", grouped(least), grouped(most)),
            };
            table = table.row([
                Cell::from(costs.build.as_str()),
                bytes(costs.flash_bytes as usize).into(),
                bytes(costs.static_ram_bytes as usize).into(),
                bytes(costs.stack_bytes as usize).into(),
                from_to((costs.instructions_min, costs.instructions_max)).into(),
                costs.model_cycles.map_or_else(|| "–".to_owned(), from_to).into(),
            ]);
        }
        section = section.table(table);
    } else if !shown.cost_texts.is_empty() {
        section = section.code(shown.cost_texts.join("\n"));
    }
    if !shown.budget.is_empty() {
        section = section.code(shown.budget.join("\n"));
    }
    for note in shown.notes {
        section = section.text(format!("Note: {note}."));
    }
    section
}

fn layers(policy: &Policy) -> Section {
    let mut table = Table::new("")
        .text("layer")
        .text("inputs")
        .text("outputs")
        .text("activation")
        .text("numbers");
    for layer in &policy.layers {
        table = table.row([
            Cell::from(layer.name.as_str()),
            layer.inputs.to_string().into(),
            layer.outputs.to_string().into(),
            layer.activation.word().into(),
            grouped((layer.weights.len() + layer.bias.len()) as u64).into(),
        ]);
    }
    let names = policy.layers.iter().map(|layer| layer.name.as_str());
    let macs: Vec<f64> = policy
        .layers
        .iter()
        .map(|layer| (layer.inputs * layer.outputs) as f64)
        .collect();
    let svg = BarChart::new("Products of the network", names)
        .panel(BarPanel::new(Axis::new("multiply-accumulates")).bars("", macs))
        .svg();
    Section::new("Layers").table(table).chart_or_reason(
        svg,
        "Products of each layer in a step, neurons that are always 0 included.",
    )
}

/// A part of the contract, and where it stands in the code.
struct Part {
    name: String,
    /// Heading of the contract, and how many of its kind stand before it.
    heading: (&'static str, usize),
    /// What the line of the code holds.
    mark: String,
}

/// Which line of the code a part of the contract became.
fn lines(shown: &Shown<'_>) -> Section {
    let policy = shown.policy;
    let file = format!("{}.c", policy.name);
    let section = Section::new("From the contract to the code");
    let Some(code) = shown.files.get(&file) else {
        return section.text("No C was made; this table is of C alone.");
    };
    let (path, text) = shown.contract;
    let mut table = Table::new(format!(
        "Lines of {path} and of {file}, where each value is stored or each step begins"
    ))
    .text("part")
    .number("contract", 0)
    .number("code", 0)
    .text("as it stands there");
    for part in parts(policy) {
        let found = code.lines().enumerate().find(|(_, line)| line.contains(&part.mark));
        let Some((index, line)) = found else { continue };
        let (heading, before) = part.heading;
        let own = text
            .lines()
            .enumerate()
            .filter(|(_, line)| line.trim_start().starts_with(heading));
        let own = own.map(|(index, _)| index + 1).nth(before);
        table = table.row([
            part.name.into(),
            own.map_or(f64::NAN, |line| line as f64).into(),
            ((index + 1) as f64).into(),
            line.trim().into(),
        ]);
    }
    section.table(table)
}

fn parts(policy: &Policy) -> Vec<Part> {
    let part = |name: String, heading, mark: String| Part { name, heading, mark };
    let signals = policy.signals.iter().enumerate().map(|(n, signal)| {
        let mark = format!("front->signal[{n}] =");
        part(format!("signal {}", signal.name), ("[[signal]]", n), mark)
    });
    let features = policy.features.iter().enumerate().map(|(n, feature)| {
        let mark = format!("front->observation[{n}] =");
        part(format!("feature {}", feature.name), ("[[feature]]", n), mark)
    });
    let layers = policy.layers.iter().map(|layer| {
        let mark = format!("/* {}: {} -> {}", layer.name, layer.inputs, layer.outputs);
        part(format!("layer {}", layer.name), ("[network]", 0), mark)
    });
    let one = |name: &str, heading, mark: &str| part(name.to_owned(), (heading, 0), mark.to_owned());
    let mut all: Vec<Part> = signals.chain(features).chain(layers).collect();
    if policy.output_names().is_empty() {
        all.push(one("choice of the action", "[actions]", "/* Network and argmax"));
        if policy.mapping.is_some() {
            all.push(one("mapping", "[mapping]", "state->mapping_b *"));
        }
        all.push(one("limits", "[limits]", "/* Mapping, limits, status. */"));
    } else {
        all.extend(policy.paths().iter().enumerate().flat_map(output_parts));
        all.push(one("limits", "[[output]]", "/* Mapping, limits, status. */"));
    }
    all.push(one("fallback", "[fallback]", "front->usable & trusted"));
    all
}

/// What is decided of one of several outputs, and its mapping.
fn output_parts((index, path): (usize, &DutyPath<'_>)) -> Vec<Part> {
    let name = path.name.unwrap_or_default();
    let entry = ("[[output]]", index);
    let command = format!("command->duty_sim[{index}] =");
    let mut all = vec![Part {
        name: format!("output {name}"),
        heading: entry,
        mark: command,
    }];
    if path.mapping.is_some() {
        all.push(Part {
            name: format!("mapping of {name}"),
            heading: entry,
            mark: format!("state->mapping_b_{name} *"),
        });
    }
    all
}

fn files(shown: &Shown<'_>) -> Section {
    let mut table = Table::new("").text("file").text("length");
    for (name, length) in &shown.written {
        table = table.row([name.as_str().into(), bytes(*length).into()]);
    }
    let digests = &shown.policy.digests;
    Section::new("Files").table(table).pairs([
        ("contract, sha256", digests.contract.clone()),
        ("weights, sha256", digests.weights.clone()),
    ])
}
