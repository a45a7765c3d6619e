//! What the stand-in of Simulink must know of a policy.

use std::fmt::Write;

use policy::{Interval, Policy, Scalar};

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
    let arguments: String = (0..coefficients.len())
        .map(|i| format!(", arriving(values[{i}])"))
        .collect();
    let set_mapping = match coefficients.is_empty() {
        true => "(void)state; (void)values; return 1u;".to_owned(),
        false => format!("return {n}_set_mapping(state{arguments});"),
    };
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
#define FALLBACK ((number){fallback:?})
#define NAN_VALUE (HUGE_VAL - HUGE_VAL)
#define CONTROLLER(type) {n}_##type
#define CONTROLLER_CALL(function) {n}_##function
static const double lows[SIGNALS] = {lows};
static const double highs[SIGNALS] = {highs};
static const double coefficient_values[COEFFICIENTS + 1] = {values};
static const double coefficient_lows[COEFFICIENTS + 1] = {coefficient_lows};
static const double coefficient_highs[COEFFICIENTS + 1] = {coefficient_highs};
static const double coefficient_zero = 0.0;
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
",
        signals = policy.signals.len(),
        count = coefficients.len(),
        features = policy.features.len(),
        actions = policy.outputs(),
        period = policy.sample_period,
        fallback = policy.fallback.duty,
        lows = arrives(|range| range.low),
        highs = arrives(|range| range.high),
        values = list(coefficients.iter().map(|(value, _)| *value).collect()),
        coefficient_lows = list(coefficients.iter().map(|(_, range)| range.low).collect()),
        coefficient_highs = list(coefficients.iter().map(|(_, range)| range.high).collect()),
    )
}

/// What can be set at run time: value and range of each coefficient of the mapping.
fn coefficients(policy: &Policy) -> Vec<(f64, Interval)> {
    let Some(mapping) = &policy.mapping else {
        return Vec::new();
    };
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
