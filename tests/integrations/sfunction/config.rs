//! What the stand-in of Simulink must know of a policy.

use std::fmt::Write;

use policy::{Interval, Mapping, Policy, Scalar};

/// What the harness must know of a policy, as C.
pub fn config(policy: &Policy) -> String {
    let n = &policy.name;
    let coefficients = coefficients(policy);
    // the range as it arrives: an ADC port takes codes
    let arrives = |pick: fn(Interval) -> f64| {
        let value = |signal: &policy::Signal| match signal.adc {
            Some(adc) => (pick(signal.range) - adc.offset) / adc.gain,
            None => pick(signal.range),
        };
        list(policy.signals.iter().map(value).collect())
    };
    let set_mapping = set_mapping(policy);
    let commanded = commanded(policy);
    let arriving = match policy.numeric_format.scalar() {
        Scalar::F32 => {
            "typedef float number;\nstatic number arriving(double x)\n{\n    \
             return (x > FLT_MAX) ? FLT_MAX : ((x < -FLT_MAX) ? -FLT_MAX : (float)x);\n}"
        }
        Scalar::F64 => "typedef double number;\nstatic number arriving(double x)\n{\n    return x;\n}",
    };
    let mut measure = String::new();
    for (i, signal) in policy.signals.iter().enumerate() {
        let convert = if signal.adc.is_some() { "code" } else { "arriving" };
        let _ = writeln!(measure, "    measured->{} = {convert}(inputs[{i}]);", signal.name);
    }
    format!(
        "#include \"{n}.h\"
#define NAME \"sf_{n}\"
#define SIGNALS {signals}
#define COEFFICIENTS {count}
#define FEATURES {features}
#define ACTIONS {actions}
#define PERIOD {period:?}
#define DUTIES {duties}
#define NAN_VALUE (HUGE_VAL - HUGE_VAL)
#define CONTROLLER(type) {n}_##type
#define CONTROLLER_CALL(function) {n}_##function
static const double lows[SIGNALS] = {lows};
static const double highs[SIGNALS] = {highs};
static const double coefficient_values[COEFFICIENTS + 1] = {values};
static const double coefficient_lows[COEFFICIENTS + 1] = {coefficient_lows};
static const double coefficient_highs[COEFFICIENTS + 1] = {coefficient_highs};
static const double coefficient_zero = 0.0;
static const double fallbacks[DUTIES] = {fallbacks};
{arriving}
static int32_t code(double x)
{{
    return isnan(x) ? INT32_MIN : ((fabs(x) > 2.0e9) ? ((x > 0.0) ? INT32_MAX : INT32_MIN) : (int32_t)lround(x));
}}
static void measure(const double *inputs, {n}_measurement *measured)
{{
    (void)arriving;
    (void)code;
{measure}}}
static uint32_t set_mapping({n}_state *state, const double *values)
{{
    {set_mapping}
}}
static void commanded(const {n}_command *command, double *duties, double *actions)
{{
{commanded}}}
",
        signals = policy.signals.len(),
        count = coefficients.len(),
        features = policy.features.len(),
        actions = policy.outputs(),
        period = policy.sample_period,
        duties = policy.paths().len(),
        fallbacks = list(policy.paths().iter().map(|path| path.fallback).collect()),
        lows = arrives(|range| range.low),
        highs = arrives(|range| range.high),
        values = list(coefficients.iter().map(|(value, _)| *value).collect()),
        coefficient_lows = list(coefficients.iter().map(|(_, range)| range.low).collect()),
        coefficient_highs = list(coefficients.iter().map(|(_, range)| range.high).collect()),
    )
}

/// Sets every mapping with its part of the values; 1 if all were accepted.
fn set_mapping(policy: &Policy) -> String {
    let mut text = "(void)state; (void)values;\n    uint32_t accepted = 1u;".to_owned();
    let mut first = 0;
    for path in policy.paths() {
        let count = path.mapping.map_or(0, |mapping| of_mapping(mapping).len());
        if count == 0 {
            continue;
        }
        let arguments: String = (first..first + count)
            .map(|i| format!(", arriving(values[{i}])"))
            .collect();
        first += count;
        let function = path.named("set_mapping");
        let _ = write!(text, "\n    accepted &= {}_{function}(state{arguments});", policy.name);
    }
    text + "\n    return accepted;"
}

/// The duties and actions of a command, one after the other.
fn commanded(policy: &Policy) -> String {
    let mut text = String::new();
    for (index, path) in policy.paths().iter().enumerate() {
        let place = path.name.map_or(String::new(), |_| format!("[{index}]"));
        let _ = writeln!(text, "    duties[{index}] = (double)command->duty{place};");
        let _ = writeln!(text, "    actions[{index}] = (double)command->action_index{place};");
    }
    text
}

/// What can be set at run time: value and range of each coefficient of the mappings.
fn coefficients(policy: &Policy) -> Vec<(f64, Interval)> {
    let paths = policy.paths();
    paths
        .iter()
        .filter_map(|path| path.mapping)
        .flat_map(of_mapping)
        .collect()
}

fn of_mapping(mapping: &Mapping) -> Vec<(f64, Interval)> {
    let own = mapping.coefficients;
    let mut all = vec![
        (own.a, mapping.adjust_a),
        (own.b, mapping.adjust_b),
        (own.c, mapping.adjust_c),
    ];
    all.extend(own.r.map(|r| (r, mapping.adjust_r)));
    all
}

/// Numbers as an initialiser in C, which is never empty.
fn list(values: Vec<f64>) -> String {
    let texts: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
    match texts.as_slice() {
        [] => "{ 0.0 }".to_owned(),
        texts => format!("{{ {} }}", texts.join(", ")),
    }
}
