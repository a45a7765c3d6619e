//! The goals of a policy: every function of the controller against the specification.

use policy::DutyPath;

use crate::emitted::{Called, Emitted};
use crate::facts;
use crate::goal::{Assumption, Goal, Pair, equal};
use crate::machine::{Kind, U32};
use crate::refusal::Refusal;
use crate::spec::{self, Chosen, Command, Own, Sensed, Spec, State};
use crate::term::Term;

/// What a step is about: any state, any measurement, any command for `commit`.
#[derive(Clone)]
struct Given {
    state: State,
    measurement: Vec<Term>,
    sensed: Sensed,
    /// Holds for every arithmetic that rounds; each has a goal of its own.
    assumptions: Vec<Assumption>,
}

impl Given {
    fn new(spec: Spec<'_>) -> Self {
        let state = State::any(spec);
        let measurement = spec::measurement(spec);
        let sensed = spec::sense(spec, &state, &measurement);
        let assumptions = facts::assumptions(spec, &state);
        Given {
            state,
            measurement,
            sensed,
            assumptions,
        }
    }

    /// With one more assumption.
    fn with(&self, assumption: Option<Assumption>) -> Self {
        let mut given = self.clone();
        given.assumptions.extend(assumption);
        given
    }
}

/// Of an output that is a NaN a curve by masks makes another number than section 7b. The check of a policy bounds every output
/// over all sound states; of another state the command is the fallback, whatever the network says.
fn numbers(spec: Spec<'_>, sensed: &Sensed, choices: &[Chosen]) -> Option<Assumption> {
    let (terms, float) = (spec.terms, spec.float);
    let numbers = choices.iter().flat_map(|choice| &choice.numbers);
    let all: Vec<Term> = numbers.map(|x| terms.not(float.is_nan(*x))).collect();
    let cases = vec![terms.not(sensed.sound), terms.all(all.iter().copied())];
    (!all.is_empty()).then(|| Assumption {
        term: terms.or(cases[0], cases[1]),
        cases,
        text: "of a sound state the network's output, and the quotient of its curve, are numbers".into(),
    })
}

/// All goals about one language's controller.
pub(crate) fn of(spec: Spec<'_>, emitted: &dyn Emitted) -> Result<Vec<Goal>, Refusal> {
    let given = Given::new(spec);
    let mut goals = Vec::new();
    // all of a step is walked through before a goal is written: what is refused costs little
    let evaluated = emitted.eval(&given.state, &given.measurement)?;
    let choices = spec::choose(spec, emitted.to_cut()?, &evaluated.outputs);
    let command = spec::decide(spec, &given.state, &given.sensed, &choices);
    let any = any_command(spec);
    let committed = emitted.commit(&given.state, &given.measurement, &any)?;
    let stepped = emitted.step(&given.state, &given.measurement)?;
    let of_head = given.with(numbers(spec, &given.sensed, &choices));
    eval(spec, emitted, &of_head, &evaluated, &command, &mut goals);
    commit(spec, emitted, &given, &committed, &any, &mut goals);
    step(spec, emitted, &given, &evaluated, &stepped, &mut goals)?;
    around(spec, emitted, &given, &evaluated, &mut goals)?;
    let asked = [evaluated.obligations, committed.obligations, stepped.obligations].concat();
    let language = emitted.language();
    let pair = Pair {
        label: "defined".into(),
        emitted: spec.terms.all(asked),
        specified: spec.terms.truth(true),
        kind: Kind::Truth,
    };
    goals.push(equal(
        spec.float,
        name(language, "defined"),
        format!("{language}: no step reads beyond a table, and no sum of signed integers overflows"),
        &[pair],
        &given.assumptions,
    ));
    Ok(goals)
}

/// Whatever a caller may hand to `commit`.
fn any_command(spec: Spec<'_>) -> Command {
    let paths = spec.policy.paths();
    let each = |stem: &str, width: u32| -> Vec<Term> {
        let inputs = paths.iter().map(|path| spec.terms.input(&path.named(stem), width));
        inputs.collect()
    };
    Command {
        duty: each("command_duty", spec.float.width()),
        duty_sim: each("command_duty_sim", spec.float.width()),
        action_index: each("index", 32),
        status: spec.terms.input("word_status", 32),
    }
}

/// Of which output a goal is, behind a dot; nothing where there is one.
fn of_output(path: &DutyPath<'_>) -> String {
    path.name.map_or(String::new(), |name| format!(".{name}"))
}

/// The same in a sentence.
fn whose(path: &DutyPath<'_>) -> String {
    path.name
        .map_or(String::new(), |name| format!(" of the output `{name}`"))
}

fn name(language: &str, part: &str) -> String {
    format!("{}.{part}", language.to_lowercase())
}

fn pair(label: impl Into<String>, emitted: Term, specified: Term, kind: Kind) -> Pair {
    Pair {
        label: label.into(),
        emitted,
        specified,
        kind,
    }
}

fn list(label: &str, emitted: &[Term], specified: &[Term], kind: Kind) -> Vec<Pair> {
    let both = emitted.iter().zip(specified).enumerate();
    both.map(|(n, (x, y))| pair(format!("{label} {n}"), *x, *y, kind))
        .collect()
}

/// That as many observations as the specification has went into as many runs of the network: a refusal would hide a defect.
fn observations(spec: Spec<'_>, called: &Called, specified: &[Term]) -> Vec<Pair> {
    let float = Kind::Float(spec.float.format);
    match called.observations.as_slice() {
        [once] if once.len() == specified.len() => list("observation", once, specified, float),
        other => {
            let count = |n: usize| spec.terms.bits(n as u64, 32);
            vec![pair("runs of the network", count(other.len()), count(1), U32)]
        }
    }
}

fn eval(
    spec: Spec<'_>,
    emitted: &dyn Emitted,
    given: &Given,
    called: &Called,
    command: &Command,
    goals: &mut Vec<Goal>,
) {
    let language = emitted.language();
    let float = Kind::Float(spec.float.format);
    let mut add = |part: &str, claim: &str, pairs: &[Pair]| {
        let claim = format!("{language}: {claim}");
        goals.push(equal(
            spec.float,
            name(language, part),
            claim,
            pairs,
            &given.assumptions,
        ));
    };
    let observed = observations(spec, called, &given.sensed.observation);
    let text = "the network gets the observation of sections 2 to 5: held samples, filters, scales and clips";
    add("observation", text, &observed);
    if let Some(found) = &called.command {
        for (index, path) in spec.policy.paths().iter().enumerate() {
            let (at, whose) = (of_output(path), whose(path));
            let mut own = |stem: &str, text: &str, both: (&[Term], &[Term]), kind| {
                let pair = pair(path.named(stem), both.0[index], both.1[index], kind);
                add(&format!("{stem}{at}"), text, &[pair]);
            };
            let text = format!(
                "`eval` commands the duty{whose} of sections 7 to 9: argmax, continuous head or gain schedule, mapping, slew limit, soft start, limits, fallback"
            );
            own("duty", &text, (&found.duty, &command.duty), float);
            let text = format!("`eval` says the duty of the chosen action{whose}, or the fallback");
            own("duty_sim", &text, (&found.duty_sim, &command.duty_sim), float);
            let text = format!("`eval` says the lowest index of the largest Q value{whose}, and 0 with STATE");
            own("action_index", &text, (&found.action_index, &command.action_index), U32);
        }
        let text = match spec.policy.paths().len() {
            1 => "`eval` sets exactly the status bits of section 9",
            _ => "`eval` sets exactly the status bits of section 9, of all outputs in one word",
        };
        add("status", text, &[pair("status", found.status, command.status, U32)]);
    }
    add(
        "pure",
        "`eval` changes nothing",
        &state_pairs(spec, &called.state, &given.state),
    );
}

/// The parts of two states.
fn state_pairs(spec: Spec<'_>, emitted: &State, specified: &State) -> Vec<Pair> {
    let groups = state_groups(spec, emitted, specified);
    groups.into_iter().flat_map(|(_, _, pairs)| pairs).collect()
}

/// Name, sentence and pairs of a part of the state.
type Group = (String, String, Vec<Pair>);

fn state_groups(spec: Spec<'_>, emitted: &State, specified: &State) -> Vec<Group> {
    let float = Kind::Float(spec.float.format);
    let memories = |state: &State| -> Vec<Term> { state.memory().copied().collect() };
    let group = |name: &str, text: &str, pairs: Vec<Pair>| (name.to_owned(), text.to_owned(), pairs);
    let mut all = vec![
        group(
            "held",
            "the signals of this step",
            list("held", &emitted.held, &specified.held, float),
        ),
        group(
            "memory",
            "the pushed words of every observer and filter, or +0",
            list("memory", &memories(emitted), &memories(specified), float),
        ),
    ];
    let both = emitted.outputs.iter().zip(&specified.outputs);
    for (path, (x, y)) in spec.policy.paths().iter().zip(both) {
        all.extend(own_groups(spec, path, x, y));
    }
    all.push(group(
        "counters",
        "the count of bad steps and `primed`",
        vec![
            pair("bad_count", emitted.bad_count, specified.bad_count, U32),
            pair("primed", emitted.primed, specified.primed, U32),
        ],
    ));
    all.into_iter().filter(|(_, _, pairs)| !pairs.is_empty()).collect()
}

/// What is remembered of one output.
fn own_groups(spec: Spec<'_>, path: &DutyPath<'_>, emitted: &Own, specified: &Own) -> [Group; 3] {
    let float = Kind::Float(spec.float.format);
    let caps = emitted.soft_cap.zip(specified.soft_cap);
    let group = |name: &str, text: &str, pairs: Vec<Pair>| {
        let (at, whose) = (of_output(path), whose(path));
        (format!("{name}{at}"), format!("{text}{whose}"), pairs)
    };
    let duties = [
        ("previous_duty", emitted.previous_duty, specified.previous_duty),
        ("previous_command", emitted.previous_command, specified.previous_command),
    ];
    [
        group(
            "remembered",
            "the duties of the command",
            duties.map(|(stem, x, y)| pair(path.named(stem), x, y, float)).into(),
        ),
        group(
            "soft_cap",
            "the raised cap, or its start",
            caps.map(|(x, y)| pair(path.named("soft_cap"), x, y, float))
                .into_iter()
                .collect(),
        ),
        group(
            "coefficients",
            "the coefficients and their check word as they are",
            coefficients(spec, path, emitted, specified),
        ),
    ]
}

fn coefficients(spec: Spec<'_>, path: &DutyPath<'_>, emitted: &Own, specified: &Own) -> Vec<Pair> {
    let float = Kind::Float(spec.float.format);
    let word = Kind::Integer {
        bits: spec.float.width(),
        signed: false,
    };
    let checks = emitted.check.zip(specified.check);
    let label = path.named("coefficient");
    let mut pairs = list(&label, &emitted.coefficients, &specified.coefficients, float);
    pairs.extend(checks.map(|(x, y)| pair(path.named("mapping_check"), x, y, word)));
    pairs
}

fn commit(
    spec: Spec<'_>,
    emitted: &dyn Emitted,
    given: &Given,
    called: &Called,
    command: &Command,
    goals: &mut Vec<Goal>,
) {
    let language = emitted.language();
    let after = spec::commit(spec, &given.state, &given.sensed, command);
    for (part, text, pairs) in state_groups(spec, &called.state, &after) {
        let claim = format!("{language}: `commit` leaves what section 10 says: {text}");
        let name = name(language, &format!("commit.{part}"));
        goals.push(equal(spec.float, name, claim, &pairs, &given.assumptions));
    }
}

/// Both sides are emitted code: with the goals of `eval` and `commit`, which are for any command, this is the whole step.
fn step(
    spec: Spec<'_>,
    emitted: &dyn Emitted,
    given: &Given,
    evaluated: &Called,
    called: &Called,
    goals: &mut Vec<Goal>,
) -> Result<(), Refusal> {
    let language = emitted.language();
    let float = Kind::Float(spec.float.format);
    let mut pairs = match evaluated.observations.first() {
        Some(observation) => observations(spec, called, observation),
        None => Vec::new(),
    };
    if let (Some(found), Some(command)) = (&called.command, &evaluated.command) {
        pairs.extend(list("duty", &found.duty, &command.duty, float));
        pairs.extend(list("duty_sim", &found.duty_sim, &command.duty_sim, float));
        pairs.extend(list("action_index", &found.action_index, &command.action_index, U32));
        pairs.push(pair("status", found.status, command.status, U32));
        let after = emitted.commit(&given.state, &given.measurement, command)?;
        pairs.extend(state_pairs(spec, &called.state, &after.state));
    }
    let claim = format!("{language}: `step` is `eval`, then `commit` with its command");
    goals.push(equal(spec.float, name(language, "step"), claim, &pairs, &[]));
    Ok(())
}

/// What is called beside the control path.
fn around(
    spec: Spec<'_>,
    emitted: &dyn Emitted,
    given: &Given,
    evaluated: &Called,
    goals: &mut Vec<Goal>,
) -> Result<(), Refusal> {
    let language = emitted.language();
    let float = Kind::Float(spec.float.format);
    let state = &given.state;
    let mut add = |part: &str, claim: &str, pairs: &[Pair]| {
        let claim = format!("{language}: {claim}");
        goals.push(equal(spec.float, name(language, part), claim, pairs, &[]));
    };
    let observed = emitted.observe(state, &given.measurement)?;
    let observation = evaluated.observations.first().map_or(&[][..], Vec::as_slice);
    let pairs = list("observation", &observed, observation, float);
    add(
        "observe",
        "`observe` gives the observation that `eval` gives to the network",
        &pairs,
    );
    let pairs = state_pairs(spec, &emitted.init(state)?, &spec::initial(spec, state));
    add("init", "`init` leaves the state of section 1", &pairs);
    let pairs = state_pairs(spec, &emitted.reset(state)?, &spec::reset(spec, state));
    add(
        "reset",
        "`reset` leaves the same, but keeps the coefficients and their check word",
        &pairs,
    );
    for (index, path) in spec.policy.paths().iter().enumerate() {
        let own = &state.outputs[index];
        if own.coefficients.is_empty() {
            continue;
        }
        let new = ["new_a", "new_b", "new_c", "new_r"].iter().zip(&own.coefficients);
        let new: Vec<Term> = new
            .map(|(name, _)| spec.terms.input(name, spec.float.width()))
            .collect();
        let (after, said) = emitted.set_mapping(path, state, &new)?;
        let accepted = spec::accepted(spec, path, &new);
        let mut specified = state.clone();
        let changed = &mut specified.outputs[index];
        for (old, new) in changed.coefficients.iter_mut().zip(&new) {
            *old = spec.terms.choose(accepted, *new, *old);
        }
        let check = spec::check_word(spec, &new);
        changed.check = own.check.map(|old| spec.terms.choose(accepted, check, old));
        let mut pairs = state_pairs(spec, &after, &specified);
        pairs.push(pair("accepted", said, spec.terms.number(accepted, 32), U32));
        let text = format!(
            "`{}` takes exactly the coefficients that section 8 accepts, writes their check word, and changes nothing else",
            path.named("set_mapping")
        );
        add(&format!("set_mapping{}", of_output(path)), &text, &pairs);
    }
    Ok(())
}
