//! The verdict for a reader.

use plant::Topology;

use crate::causes::CURVES;
use crate::doubts::{self, Doubt};
use crate::examine::Examined;
use crate::findings::{Aside, Named, Verdict};
use crate::gain::Shift;
use crate::rivals::RivalValue;
use crate::shape::Structure;
use crate::timing;

/// Rivals of a cause that the sentence names; a reader remembers no more, and the rest stands in the list.
const MOST_SAID: usize = 3;

/// The verdict in a sentence; `aside` was left out of what was `found`, whose structure then is what it leaves there. `left` is what is left
/// where nothing explains it.
pub fn sentence(found: &Examined, causes: &[Named], aside: Option<&Aside>, left: &[Structure]) -> String {
    let lines = shapes(&found.lines);
    let beside = match found.lines.is_empty() {
        true => String::new(),
        false => format!(
            " Beside it there is {lines}. No cause of the list makes that, and what was found does not hang on it."
        ),
    };
    match found.verdict {
        Verdict::Unexplained if found.is_misread() => {
            let faults = doubts::said(&found.doubts).join("; ");
            format!(
                "The records are not read as they were made: {faults}. Read so, the model explains them within their noise, and no cause is named."
            )
        }
        Verdict::Unexplained => {
            let left = match left.is_empty() {
                true => String::new(),
                false => format!("; left is {}", worst_shapes(left)),
            };
            if found.fits_training_alone() {
                let doubts = doubts::said(&found.doubts).join("; ");
                let what = match found.named.is_empty() {
                    true => "The model as given explains the training records within their noise, and not",
                    false => "What explains the training records does not hold in",
                };
                return format!("{what} what was held out: {doubts}.");
            }
            // a fault of the bench first: it is what the reader can mend
            let (bench, others): (Vec<Doubt>, Vec<Doubt>) =
                (found.doubts.iter().cloned()).partition(|doubt| matches!(doubt, Doubt::Bench(_)));
            let said = |doubts: &[Doubt]| -> String {
                doubts::said(doubts).iter().map(|doubt| format!("; {doubt}")).collect()
            };
            let (bench, others) = (said(&bench), said(&others));
            if let Some((part, edges)) = &found.all_but {
                return without_part(found, part, edges.as_deref(), &bench);
            }
            format!("None of the known causes explains the records{bench}{left}{others}.")
        }
        Verdict::Consistent if !found.lines.is_empty() => {
            format!("The model explains the records but for {lines}. No cause of the list makes that.")
        }
        Verdict::Consistent => match edges(found) {
            None => "The model explains the records within their noise: nothing to correct.".to_owned(),
            Some(edges) => {
                format!("The model explains the records within their noise, with one thing beside it. {edges}.")
            }
        },
        Verdict::Explained | Verdict::Ambiguous | Verdict::MostlyExplained => {
            let ties = causes.iter().filter(|cause| !cause.rivals.is_empty());
            let ties: Vec<String> = ties.map(|cause| tie(cause, causes)).collect();
            let (list, ties) = (values(causes), ties.join(" "));
            match aside {
                None if ties.is_empty() => format!("What the model gets wrong is {list}.{beside}"),
                None => format!("More than one explanation fits. One is {list}. {ties}{beside}"),
                Some(aside) => {
                    let what = match aside.channel {
                        Some(channel) => channel.to_owned(),
                        None => format!("the record {}", aside.name()),
                    };
                    let left = match found.structure.is_empty() {
                        true => String::new(),
                        false => format!(", where {} is left", shapes(&found.structure)),
                    };
                    let said = match ties.is_empty() {
                        true => format!("this is explained: what the model gets wrong is {list}."),
                        false => format!("more than one explanation fits. One is {list}. {ties}"),
                    };
                    format!("Without {what} {said} No known cause explains {what}{left}.{beside}")
                }
            }
        }
    }
}

/// Said where the model as given explains all but a `part`: what is left of that. What causes ended at that were bent for it says nothing.
fn without_part(found: &Examined, part: &str, edges: Option<&str>, bench: &str) -> String {
    let is_bent = |doubt: &&Doubt| {
        matches!(
            doubt,
            Doubt::Bound(_) | Doubt::Open(_) | Doubt::Loose(_) | Doubt::Edges(_) | Doubt::Bench(_)
        )
    };
    let own: Vec<Structure> = (found.structure.iter().filter(|one| one.channel == part))
        .cloned()
        .collect();
    // of a record all that is left of it is told
    let left = worst_shapes(if own.is_empty() { &found.structure } else { &own });
    let left = if left.is_empty() {
        left
    } else {
        format!("; left is {left}")
    };
    let others: Vec<Doubt> = (found.doubts.iter().filter(|doubt| !is_bent(doubt))).cloned().collect();
    let others: String = doubts::said(&others).iter().map(|doubt| format!("; {doubt}")).collect();
    let edges = edges.map_or(String::new(), |edges| format!(", with one thing beside it. {edges}"));
    format!(
        "Without {part} the model as given explains the records{edges}. No known cause explains {part}{bench}{left}{others}."
    )
}

/// Share of the error above the noise from which on what is said of the rest is that of the rest: swings behind steps that a cause almost
/// takes away look like lost pulses or jitter without it.
// the fifth verdict asks for as much
pub const MOST_OF_IT: f64 = 0.9;

/// What is left, channel by channel.
fn shapes(structure: &[Structure]) -> String {
    let shape = |s: &Structure| format!("{} of {}: {}", s.channel, s.record, s.shape);
    structure.iter().map(shape).collect::<Vec<_>>().join("; ")
}

/// What is left, each channel once: in the record in which most is.
fn worst_shapes(structure: &[Structure]) -> String {
    let mut channels: Vec<&str> = Vec::new();
    for one in structure {
        if !channels.contains(&one.channel) {
            channels.push(one.channel);
        }
    }
    let worst = |channel: &&str| {
        let own = || structure.iter().filter(|one| one.channel == *channel);
        let first = own().max_by(|a, b| a.mean_square.total_cmp(&b.mean_square))?;
        let others = match own().count() - 1 {
            0 => String::new(),
            1 => " (one more record shows something)".to_owned(),
            more => format!(" ({more} more records show something)"),
        };
        Some(format!(
            "{} of {}: {}{others}",
            first.channel, first.record, first.shape
        ))
    };
    channels.iter().filter_map(worst).collect::<Vec<_>>().join("; ")
}

/// Causes with their values.
fn values(causes: &[Named]) -> String {
    let words = causes.iter().map(|cause| {
        let values = cause.parameters.iter().map(|(name, v)| {
            if let (Some(value), Some(model)) = (timing::word(cause.id, v.value), timing::word(cause.id, v.model)) {
                return format!("{value} (model {model})");
            }
            let unit = unit(v.unit);
            let name = if *name == cause.id {
                String::new()
            } else {
                format!("{name} ")
            };
            format!(
                "{name}{} (95 %: {} to {}; model {})",
                si(v.value, unit),
                si(v.low, unit),
                si(v.high, unit),
                si(v.model, unit)
            )
        });
        format!(
            "{} [{}]: {}",
            cause.words,
            cause.id,
            values.collect::<Vec<_>>().join(", ")
        )
    });
    words.collect::<Vec<_>>().join("; ")
}

/// An error below this share of the noise is told beside a word on how that is estimated: less than 1 by more than chance, in a
/// record of a hundred rows and more.
const BELOW: f64 = 0.9;

/// The noise beside an error of the better model, which is less where rounding or a ring was taken for noise.
pub fn noise(after: f64, floor: f64, of: &'static str) -> String {
    let said = si(floor, of);
    match after < BELOW * floor {
        true => format!("{said} as estimated from neighbouring rows, which is more than what is left"),
        false => said,
    }
}

/// A value of a cause, in its unit or as the word that stands for it.
pub fn told(id: &str, value: f64, of: &'static str) -> String {
    timing::word(id, value).map_or_else(|| si(value, unit(of)), str::to_owned)
}

/// Said behind the verdict where nothing explains the records, and their carrier is another all the same.
pub fn other_carrier(found: &Examined) -> String {
    let carrier = found.read_off.iter().find(|cause| cause.id == timing::ID);
    carrier.map_or_else(String::new, |cause| {
        format!(
            " That is so with the carrier that the current shows, {}, too.",
            values(std::slice::from_ref(cause))
        )
    })
}

/// What could stand in the place of a cause, or be a part of it: a sentence each.
fn tie(cause: &Named, causes: &[Named]) -> String {
    let is_other = |id: &&&str| causes.iter().all(|own| own.id != **id);
    // what stands beside all causes takes a part of them
    let is_beside = |ids: &&Vec<&str>| ids.contains(&cause.id) && ids.iter().any(|id| is_other(&id));
    let rivals = cause.rivals.iter().zip(&cause.rival_values);
    let (inside, whole): (Vec<_>, Vec<_>) = rivals.partition(|(ids, _)| is_beside(ids));
    let has_none = |ids: &Vec<&str>| causes.len() > 1 && causes.iter().all(|own| !ids.contains(&own.id));
    let (others, own): (Vec<_>, Vec<_>) = whole.into_iter().partition(|(ids, _)| has_none(ids));
    let all = if causes.len() == 2 { "both" } else { "all of them" };
    let mut sentences: Vec<String> = [(cause.id, own), (all, others)]
        .iter()
        .filter(|(_, rivals)| !rivals.is_empty())
        .map(|(place, rivals)| in_place_of(place, rivals.iter().map(|(_, values)| needs(values))))
        .collect();
    let extra: Vec<&str> = inside
        .iter()
        .flat_map(|(ids, _)| ids.iter().filter(is_other))
        .copied()
        .collect();
    if !extra.is_empty() {
        sentences.push(format!("A part of {} could be {}.", cause.id, extra.join(" or ")));
    }
    sentences.join(" ")
}

/// What could stand in a place, as much as a reader remembers.
fn in_place_of(place: &str, rivals: impl Iterator<Item = String>) -> String {
    let rivals: Vec<String> = rivals.collect();
    let more = match rivals.len().saturating_sub(MOST_SAID) {
        0 => String::new(),
        1 => ", or one other".to_owned(),
        more => format!(", or {more} others"),
    };
    let said = rivals[..rivals.len().min(MOST_SAID)].join(", or ");
    format!("In place of {place} it could be {said}{more}.")
}

/// A rival with the values that it needs: `dcr 150.2 mohm + diode (v_f 1.1 V, r_d 20 mohm)`.
#[must_use]
pub fn needs(values: &[RivalValue]) -> String {
    let mut causes: Vec<(&str, Vec<String>)> = Vec::new();
    for one in values {
        let value = si(one.value, unit(one.unit));
        match causes.iter_mut().find(|(id, _)| *id == one.id) {
            Some((_, list)) => list.push(format!("{} {value}", one.parameter)),
            None => causes.push((one.id, vec![format!("{} {value}", one.parameter)])),
        }
    }
    let one = |(id, list): &(&str, Vec<String>)| match &list[..] {
        // `dcr 150 mohm`, not `dcr (dcr 150 mohm)`
        [only] if only.starts_with(&format!("{id} ")) => only.clone(),
        _ => format!("{id} ({})", list.join(", ")),
    };
    causes.iter().map(one).collect::<Vec<_>>().join(" + ")
}

/// Said where nothing explains the records: which causes come nearest, and the share of the error above the noise that they take away.
/// Intervals would claim more than is known. `fits_training` if nothing but the held-out records speaks against them; `left` is what they
/// leave, of which the channel that is farthest off is told.
pub fn nearest(partial: &[Named], removed: f64, fits_training: bool, left: &[Structure]) -> String {
    let one = |cause: &Named| {
        let values = cause.parameters.iter().map(|(name, v)| {
            let unit = unit(v.unit);
            let name = if *name == cause.id { "" } else { name };
            format!("{name} {} (model {})", si(v.value, unit), si(v.model, unit))
                .trim_start()
                .to_owned()
        });
        let values: Vec<String> = values.collect();
        format!("{} [{}]: {}", cause.words, cause.id, values.join(", "))
    };
    let list: Vec<String> = partial.iter().map(one).collect();
    match list.is_empty() {
        // nothing is left of the training records that a cause could take away
        true if fits_training => String::new(),
        true => " No cause takes away a part of it that is more than noise.".to_owned(),
        // "takes away 100 %" and "no explanation" in one sentence: what speaks against it has been said before
        false if fits_training => format!(
            " Nearest comes {}. That explains the training records. What is held out shows something that they do not: fit it, too, and hold \
             out another record.",
            list.join("; with ")
        ),
        false if removed > 0.995 => format!(
            " Nearest comes {}. That takes away the error above the noise as a whole, but what was said above speaks against it.",
            list.join("; with ")
        ),
        // what forbids it is no structure, and has been said above
        false if left.is_empty() => format!(
            " Nearest comes {}. That takes away {:.0} % of the error above the noise, but what was said above speaks against it.",
            list.join("; with "),
            100.0 * removed
        ),
        false => {
            let worst = left.iter().max_by(|a, b| a.mean_square.total_cmp(&b.mean_square));
            let rest = worst.map_or(String::new(), |one| {
                format!(", which leaves {}", shapes(std::slice::from_ref(one)))
            });
            let is_curve = removed >= MOST_OF_IT && matches!(partial, [only] if CURVES.contains(&only.id));
            let but = match is_curve {
                true => ", but a part whose curve is not one of the law's looks like this: check it first",
                false => "",
            };
            let away = match removed < 0.005 {
                true => "nothing of the error above the noise".to_owned(),
                false => format!("{:.0} % of the error above the noise", 100.0 * removed),
            };
            format!(
                " Nearest comes {}{rest}. That takes away {away}: too little for an explanation{but}.",
                list.join("; with ")
            )
        }
    }
}

/// Standard deviations of the voltage's noise that somebody sees who lays the model over the record. A convention.
const SEEN: f64 = 3.0;

/// A duty that the edges of the gate take or give, where it is more than their usual scatter or is seen in the voltage: a dead time that the model lacks by so
/// little is taken for edges, and nobody would know.
#[must_use]
pub fn edges(found: &Examined) -> Option<String> {
    let problem = &found.problem;
    let trim = found
        .attribution
        .state()
        .starts
        .trim_or_none(problem.base.plant.converter.f_sw);
    let p = &problem.base.plant.converter;
    // what a duty of 1 would add to the output: v_in, and of the others, whose d v / d duty is that, v^2 / v_in and (v_in + v)^2 / v_in
    let span = p.topology.span(p.v_in, problem.bases.v);
    let output = span * span / p.v_in;
    // or more than can be overlooked in the voltage
    let is_seen = trim.abs() > problem.duty_accuracy() || (trim * output).abs() > SEEN * problem.sigma[0];
    (found.verdict != Verdict::Unexplained && is_seen).then(|| {
        let [time, volts] = [(trim * problem.bases.t_sw, "s"), (trim * output, "V")]
            .map(|(value, unit)| si(value.abs(), unit));
        let (way, less) = if trim < 0.0 { ("lost", "more") } else { ("won", "less") };
        format!(
            "{time} of on-time are {way} in each period ({volts} of the output) and put down to edges of the gate: if dead time or delays of \
             the bench are not those of the model, they are {less} by this. A voltage that is read off by as much would look the same: a \
             multimeter at the output tells"
        )
    })
}

/// What both current sensors show alike may be a current.
pub fn drawn_beside(found: &Examined) -> Option<String> {
    let attribution = &found.attribution;
    let causes = attribution.best.iter().flat_map(|best| &best.causes);
    let of_both = |cause: &usize| {
        let candidate = &attribution.candidates[*cause];
        candidate.cause.id == "i_offset" && candidate.form.knobs[0].keys.len() == 2
    };
    (found.verdict != Verdict::Unexplained && causes.into_iter().any(of_both)).then(|| {
        "an offset of both current sensors looks like a constant current that is drawn beside the load and stands in no column, a fan or a \
         second board: with it the voltage sags as well, by as much as the same step of the load makes it"
            .to_owned()
    })
}

/// What a part has where the converter works, of each curve that was found or comes nearest: the number that a meter at the bench shows.
pub fn curves(found: &Examined) -> Vec<String> {
    let Examined {
        problem, attribution, ..
    } = found;
    let (bases, before, after) = (&problem.bases, &problem.base.plant, &attribution.state().model.plant);
    let causes = attribution.best.iter().flat_map(|best| &best.causes);
    let note = |id: &str| {
        let (part, what, at, values) = match id {
            "c_derating" => (
                "output capacitor",
                "F",
                si(bases.v, "V"),
                [before, after].map(|plant| plant.capacitance_at(bases.v)),
            ),
            "l_saturation" => (
                "inductor",
                "H",
                si(bases.i, "A"),
                [before, after].map(|plant| plant.inductance_at(bases.i)),
            ),
            _ => return None,
        };
        let [before, after] = values.map(|value| si(value, what));
        Some(format!(
            "along its curve the {part} has {after} at {at}, where the model as given has {before}"
        ))
    };
    causes.filter_map(|cause| note(attribution.id(*cause))).collect()
}

/// Where a resistance of the source lies that was found without an input capacitor, and what it would be before one.
pub fn pulsed(found: &Examined) -> Option<String> {
    let Examined {
        problem, attribution, ..
    } = found;
    let best = attribution.best.as_ref()?;
    let is_source = |cause: &usize| attribution.id(*cause) == "source_impedance";
    let (plant, bases) = (&attribution.state().model.plant, &problem.bases);
    let resistance = plant.source.resistance;
    let has_none = plant.source.c_in == 0.0 && best.causes.iter().any(is_source) && resistance > 0.0;
    // the switch of a boost does not interrupt what the source gives
    let duty = match plant.converter.topology {
        Topology::Buck => bases.v / bases.v_in,
        Topology::BuckBoost => bases.v / (bases.v + bases.v_in),
        Topology::Boost => return None,
    };
    (has_none && duty < 1.0).then(|| {
        format!(
            "the model has no input capacitor, so that {} of the source carry the pulses of the switch's current and lie between that capacitor \
             and the switch. Leads or a fuse before a capacitor have about {} where they do the same: with source.c_in and source.esr_in in the \
             plant file that is what is sought",
            si(resistance, "ohm"),
            si(resistance / duty, "ohm")
        )
    })
}

/// Said behind the verdict: what no fit to the training records can know.
pub fn shifted(shifts: &[Shift]) -> String {
    let one = |shift: &Shift| {
        let (channel, record) = (shift.channel, &shift.record);
        match shift.throughout {
            true => format!(
                " In {channel} the held-out record {record} lies {} {} the extended model throughout (training records: {}): something \
                 shifted between them.",
                si(shift.mean.abs(), shift.unit),
                if shift.mean > 0.0 { "above" } else { "below" },
                si(shift.training, shift.unit)
            ),
            // its mean says little there
            false => format!(
                " In {channel} the held-out record {record} is {:.1} times as far from the extended model as the training records: \
                 something was different there, or these do not show it.",
                shift.ratio
            ),
        }
    };
    shifts.iter().map(one).collect()
}

/// The unit of a number, nothing for a pure one.
pub fn unit(text: &'static str) -> &'static str {
    match text {
        "1" => "",
        text => text,
    }
}

/// A quantity with four digits.
pub fn si(value: f64, unit: &str) -> String {
    if value == 0.0 {
        return if unit.is_empty() {
            "0".to_owned()
        } else {
            format!("0 {unit}")
        };
    }
    report::quantity(value, unit, 4)
}
