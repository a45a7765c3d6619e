//! The texts of all faults of files, keys, values and names, side by side so that they speak with one voice.
//!
//! Those that any TOML file can have come from [`toml_input::messages`], those of tensors and layer chains stand in
//! [`crate::weights::catalogue`].

use toml_input::Message;

use crate::model::Interval;
pub(crate) use toml_input::messages::{
    count, crossed, exactly_one_of, missing_key, not_finite, not_one_of, not_positive, out_of_range, wrong_length,
};

// --- files ---

pub(crate) fn outside_root(file: &str) -> Message {
    Message::new(format!("`{file}` lies outside the crate"))
        .expected("a path inside the folder of Cargo.toml")
        .hint("copy the file into the crate, so that a build elsewhere finds the same one")
}

pub(crate) fn outside_folder(file: &str) -> Message {
    Message::new(format!("`{file}` lies outside the contract's folder"))
        .expected("a path inside the folder of the contract")
        .hint("copy the file there, or say --allow-outside if you know where the contract comes from")
}

// --- form ---

pub(crate) fn not_supported_yet(label: &str, found: &str, supported: &[&str]) -> Message {
    Message::new(format!("`{label}` = \"{}\" is not supported yet", found.escape_debug()))
        .found(format!("\"{}\"", found.escape_debug()))
        .expected(format!("supported: {}", supported.join(", ")))
}

pub(crate) fn incomplete() -> Message {
    Message::new("the contract is incomplete").hint("please report this: the missing part should have been named")
}

// --- values ---

pub(crate) fn foreign_activation(found: &str, known: &str) -> Message {
    Message::new("`hidden_activation` names a function that policyc does not have")
        .found(format!("\"{}\"", found.escape_debug()))
        .expected(format!("one of {known}, leaky_relu with its slope"))
        .hint("train with one of these; another function in its place would be another policy")
}

pub(crate) fn decimal_commas(label: &str, found: usize) -> Message {
    Message::new(format!("`{label}` seems to be written with decimal commas"))
        .found(format!("{found} whole numbers, every second one 0"))
        .expected("a decimal point, and a comma between two values")
        .hint("write 0.10, 0.15 instead of 0,10, 0,15")
}

pub(crate) fn duty_range(label: &str, found: f64) -> Message {
    // a little above 1 is a duty ratio that is too large; above 100 it is no percentage, and a wrong hint is worse than none
    let percent = (2.0..=100.0).contains(&found);
    let hint = match found {
        // no duty is negative, and no converter has one; a step of one is
        found if found < 0.0 => Some(
            "if the actions change the duty before by so much, write base = \"previous_duty\" and these numbers as `offsets` in the place \
             of `duties`"
                .to_owned(),
        ),
        found => percent.then(|| format!("looks like a percentage: write {}", tidy(found / 100.0))),
    };
    Message::new(format!("`{label}` is not a duty ratio"))
        .found(found.to_string())
        .expected("0 to 1")
        .maybe_hint(hint)
}

pub(crate) fn unbounded_gain() -> Message {
    Message::new("nothing bounds this gain")
        .found("neither `squash` nor `clip` nor `limits`")
        .expected("at least one of them")
}

pub(crate) fn one_gain(gain: f64) -> Message {
    Message::new("these limits leave one gain, whatever the network says")
        .found(gain.to_string())
        .expected("limits that scale and offset reach into")
}

pub(crate) fn one_output(names: &[&str]) -> Message {
    Message::new("this contract has several outputs, and one duty is taken here")
        .found(format!("outputs {}", names.join(", ")))
        .expected("a contract with one output")
        .hint(
            "training has one duty, and so have the environments of the wheel; `policyc new MODEL --output N` writes a contract for one of them",
        )
}

pub(crate) fn beside_outputs(key: &str) -> Message {
    Message::new(format!("[{key}] stands beside [[output]]"))
        .expected(format!("`{key}` in each [[output]]"))
        .hint("with several outputs each has its own actions, limits and mapping")
}

pub(crate) fn law_of_several() -> Message {
    Message::new("a law of control has one output")
        .found("`base`, `offsets` or `gains` in an [[output]]")
        .expected("`duties`, `pairs` or `continuous`")
        .hint("write a contract for each output: `policyc new MODEL --output N`")
}

pub(crate) fn whose_duty(names: &[String]) -> Message {
    let first = names.first().map_or("left", String::as_str);
    missing_key(
        "duty",
        "[[observer]]",
        &format!("which of the outputs drives this model: `duty = \"{first}\"`"),
    )
    .expected(format!("one of {}", names.join(", ")))
}

pub(crate) fn one_duty() -> Message {
    Message::new("`duty` names one of several outputs, and this contract has one")
        .found("`duty` in an [[observer]] without [[output]]")
        .hint("leave it out: the only duty drives the model")
}

pub(crate) fn columns_overlap(own: &std::ops::Range<usize>, other: &std::ops::Range<usize>) -> Message {
    Message::new("a column of the last layer decides two outputs")
        .found(format!("columns {} and {}", between(own), between(other)))
        .expected("columns of its own for each output")
}

pub(crate) fn columns_outside(own: &std::ops::Range<usize>, columns: usize) -> Message {
    Message::new("an output lies outside of the last layer")
        .found(format!("columns {} of {columns}", between(own)))
        .expected("every column in one output: as many as the outputs need together, from 0 on")
}

fn between(columns: &std::ops::Range<usize>) -> String {
    format!("{} to {}", columns.start, columns.end.saturating_sub(1))
}

/// A quotient by 100 without the binary noise (0.44 rather than 0.44000000000000006).
pub(crate) fn tidy(x: f64) -> f64 {
    // nobody types a duty or a period with more decimals; the binary noise lies behind the sixteenth digit
    (x * 1e12).round() / 1e12
}

pub(crate) fn empty_range(label: &str, at: f64) -> Message {
    Message::new(format!("`{label}` is a single point"))
        .found(format!("low = high = {at}"))
        .expected("low < high")
}

pub(crate) fn empty_after_rounding(label: &str, low: f64, high: f64) -> Message {
    Message::new(format!("no f32 number lies inside `{label}`"))
        .found(format!("[{low}, {high}]"))
        .expected("an interval that holds an f32 number after rounding inwards")
        .hint("make it a little wider")
}

pub(crate) fn not_in_f32(label: &str, value: f64) -> Message {
    let what = if value.abs() > 1.0 {
        "too large for f32"
    } else {
        "rounds to 0 in f32"
    };
    Message::new(format!("`{label}` {what}"))
        .found(format!("{value:e}"))
        .expected("0, or a magnitude of 1.2e-38 to 8e37")
}

pub(crate) fn outside(label: &str, value: f64, name: &str, low: f64, high: f64) -> Message {
    Message::new(format!("`{label}` lies outside {name}"))
        .found(value.to_string())
        .expected(format!("{low} to {high}"))
}

pub(crate) fn adc_codes(name: &str, low: f64, high: f64) -> Message {
    Message::new(format!(
        "the plausible range of `{name}` is beyond what its ADC code can say"
    ))
    .found(format!("codes {low} to {high}"))
    .expected("codes within -16777216 to 16777216")
    .hint("gain is the physical unit per code: physical = gain * code + offset")
}

pub(crate) fn adc_shows_nothing(name: &str, shown: Interval) -> Message {
    Message::new(format!("no two codes of the ADC are plausible values of `{name}`"))
        .found(format!("{} to {} over all codes", shown.low, shown.high))
        .expected("a plausible range that the codes reach")
        .hint("a converter whose codes fall while the value rises has an offset at the other end: physical = gain * code + offset")
}

/// What ends a range at or beyond the end of its converter: `end` is the value at the last or the first code, `step`
/// that of a code.
pub(crate) fn adc_saturates(name: &str, end: f64, step: f64, range: Interval) -> Message {
    // a range is stated with some room; one that is half as wide again as what the converter shows is that of another divider
    let reached = if end > 0.0 { range.high / end } else { range.low / end };
    let hint = if reached > 1.5 {
        "this converter ends far inside of the range: is `gain`, with the divider or the shunt before it, that of the board? If it is, the \
         policy needs values that nobody measures; only if it does not, end the range before the codes do"
            .to_owned()
    } else {
        let last = tidy(end - step.copysign(end));
        format!(
            "let the range end at {last}, a code before: a converter that is stuck at its end would else pass for a measurement"
        )
    };
    Message::new(format!(
        "an ADC at the end of its codes is a plausible value of `{name}`"
    ))
    .found(format!(
        "{end} at that code, and a range of {} to {}",
        range.low, range.high
    ))
    .expected("a range that ends before the codes do")
    .hint(hint)
}

pub(crate) fn soft_start_too_slow(increment: f64) -> Message {
    Message::new("the soft start is too slow for f32")
        .found(format!("a step of {increment:e}"))
        .expected("(largest duty - from) / steps of at least 1.2e-7")
        .hint("take fewer steps, or start further below the largest duty")
}

pub(crate) fn not_increasing(i_out: f64, slope: f64) -> Message {
    Message::new("the mapping does not rise with d_sim")
        .found(format!("a + r i = {slope} at i_out = {i_out}"))
        .expected("a + r i > 0 over the valid range of i_out")
        .hint("a duty that falls while the policy asks for more turns the loop's sign: check the fit")
}

pub(crate) fn needs_other(label: &str, other: &str) -> Message {
    Message::new(format!("`{label}` is given without `{other}`"))
        .hint(format!("give `{other}` as well, or leave it out"))
}

pub(crate) fn time_constant(found: f64, longest: f64) -> Message {
    let hint = "f32 cannot follow a pole that slow: take a shorter time constant or a longer sample period";
    Message::new("the time constant is out of range")
        .found(format!("{found} s"))
        .expected(format!("more than 0, at most {longest} s (1e6 sample periods)"))
        .hint(hint)
}

pub(crate) fn may_overflow(what: &str, magnitude: f64) -> Message {
    Message::new(format!("{what} could leave the range of f32"))
        .found(format!("magnitudes up to {magnitude:e}"))
        .expected(format!("at most {:e}", crate::limits::MAX_MAGNITUDE))
        .hint("narrow the plausible ranges or the clips, or scale the features down")
}

// --- names ---

pub(crate) fn list_in_parameters(name: &str) -> Message {
    Message::new(format!("`{name}` stands in [parameters]")).hint(format!(
        "in TOML what follows a [table] belongs to it: write `parameters = {{ ... }}` in one line, or each entry as [[{name}]]"
    ))
}

pub(crate) fn bad_name(kind: &str, name: &str, hint: &str) -> Message {
    Message::new(format!("`{}` cannot be the name of a {kind}", name.escape_debug()))
        .found(format!("\"{}\"", name.escape_debug()))
        .expected("a lower-case letter, then up to 30 of a-z, 0-9, _")
        .hint(hint)
}

pub(crate) fn duplicate_name(kind: &str, name: &str, other: &str) -> Message {
    Message::new(format!("the name `{}` is used twice", name.escape_debug()))
        .found(format!("a {kind} and a {other} of this name"))
        .expected("a name of its own")
}

pub(crate) fn unknown_name(kind: &str, name: &str, known: &[&str]) -> Message {
    Message::new(format!("there is no {kind} `{}`", name.escape_debug()))
        .expected(format!("one of {}", known.join(", ")))
        .did_you_mean(name, known.iter().copied())
}

pub(crate) fn no_surplus(of: &str, instead: &str) -> Message {
    Message::new(format!("no surplus is estimated for {of}"))
        .found("hold")
        .hint(instead)
}

pub(crate) fn bad_unit(found: &str) -> Message {
    Message::new("this unit cannot be printed in a comment")
        .found(format!("\"{}\"", found.escape_debug()))
        .expected("at most 16 printable characters without quotes, backslash, */ or newline")
}

// --- expressions ---

pub(crate) fn expression(problem: &str) -> Message {
    Message::new(problem)
}

#[cfg(test)]
mod tests {
    use super::{adc_saturates, tidy};
    use crate::model::Interval;

    /// Ends of either sign and below 1, as of a quantity per unit: half as wide again is still a matter of one code.
    #[test]
    fn a_range_far_beyond_its_converter_asks_for_the_gain() {
        let hint = |end: f64, low: f64, high: f64| {
            let message = adc_saturates("x", end, 0.125, Interval { low, high });
            format!("{message:?}")
        };
        for (end, low, high) in [(0.5, -0.5, 1.0), (-0.5, -1.0, 0.5), (8.0, 0.0, 12.5)] {
            let said = hint(end, low, high);
            assert!(said.contains("ends far inside of the range"), "{said}");
        }
        for (end, low, high, last) in [
            (0.5, -4.0, 0.75, "0.375"),
            (-0.5, -0.75, 4.0, "-0.375"),
            (8.0, 0.0, 12.0, "7.875"),
        ] {
            let said = hint(end, low, high);
            assert!(
                said.contains(&format!("let the range end at {last}, a code before")),
                "{said}"
            );
        }
    }

    #[test]
    fn the_noise_of_a_quotient_is_left_out_and_nothing_else() {
        assert_eq!(tidy(0.440_000_000_000_000_06), 0.44);
        for x in [0.44, 123.456_789_012, 1e-12, 10_000.000_1, 0.0, -0.07] {
            assert_eq!(tidy(x), x);
        }
    }
}
