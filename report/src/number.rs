//! Numbers as text, by fixed rules.

/// Values beyond cannot be placed on an axis next to others; they leave a gap as NaN does.
// about the root of the largest binary64: products of two such values stay finite
const HUGE: f64 = 1e150;

/// Whether a value has a place on an axis.
pub fn drawable(value: f64) -> bool {
    value.abs() <= HUGE
}

/// Power of ten, correctly rounded (`powi` is not).
pub fn power_of_ten(exponent: i32) -> f64 {
    format!("1e{exponent}").parse().unwrap_or(f64::INFINITY)
}

/// Largest `e` with `10^e <= value`, for a positive value.
pub fn decade(value: f64) -> i32 {
    let guess = libm::floor(libm::log10(value)) as i32;
    // log10 may be off by one unit in the last place at a power of ten
    if power_of_ten(guess + 1) <= value {
        guess + 1
    } else if power_of_ten(guess) > value {
        guess - 1
    } else {
        guess
    }
}

/// SI prefix of 10^exponent, a multiple of three from -15 to 12.
pub fn prefix(exponent: i32) -> &'static str {
    const PREFIXES: [&str; 10] = ["f", "p", "n", "µ", "m", "", "k", "M", "G", "T"];
    let index = exponent / 3 + 5;
    usize::try_from(index)
        .ok()
        .and_then(|n| PREFIXES.get(n))
        .copied()
        .unwrap_or("")
}

/// Multiple of three below the decade of `value`, within the prefixes; 0 for zero.
pub fn engineering_exponent(value: f64) -> i32 {
    if value == 0.0 || !value.is_finite() {
        return 0;
    }
    (decade(value.abs()).div_euclid(3) * 3).clamp(-15, 12)
}

/// Units that take an SI prefix; others (`%`, `dB`, `ticks`, `V/s`) are left alone.
pub fn takes_prefix(unit: &str) -> bool {
    const UNITS: [&str; 14] = ["s", "V", "A", "W", "Hz", "H", "F", "Ω", "J", "C", "K", "m", "S", "T"];
    UNITS.contains(&unit)
}

/// `decimals` digits after the point, a true minus sign, and no negative zero.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        // a minus before zeros would say something that the digits do not
        Some(rest) if rest.bytes().all(|b| b == b'0' || b == b'.') => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

/// `10ⁿ` with the exponent raised.
pub fn raised_power(exponent: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digits = exponent.to_string();
    let raised = digits.chars().map(|c| match c.to_digit(10) {
        Some(digit) => RAISED[digit as usize],
        None => '⁻',
    });
    std::iter::once('1').chain(std::iter::once('0')).chain(raised).collect()
}

/// A value with SI prefix and unit to `digits` significant digits: `12.3 mV`. A unit that takes no prefix (`%`, none)
/// leaves the number plain, or as a power of ten when it is very small or large.
///
/// ```
/// assert_eq!(report::quantity(0.012_345, "V", 3), "12.3 mV");
/// assert_eq!(report::quantity(-4.7e-6, "H", 2), "−4.7 µH");
/// assert_eq!(report::quantity(0.5, "", 3), "0.500");
/// ```
pub fn quantity(value: f64, unit: &str, digits: usize) -> String {
    let digits = digits.clamp(1, 17);
    if !value.is_finite() {
        return if value.is_nan() {
            "NaN"
        } else if value > 0.0 {
            "∞"
        } else {
            "−∞"
        }
        .to_owned();
    }
    // rounded first: 999.96 to three digits is 1.00 k
    let value: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    // from the value itself: scaling rounds, and could fall below a power of ten
    // the logarithm of 0 is no power of ten
    let leading = if value == 0.0 { 0 } else { decade(value.abs()) };
    let places = |exponent: i32| usize::try_from(digits as i32 - 1 - (leading - exponent)).unwrap_or(0);
    let (text, prefix) = if takes_prefix(unit) {
        let exponent = engineering_exponent(value);
        (fixed(shifted(value, -exponent), places(exponent)), prefix(exponent))
    } else if !(-4..6).contains(&leading) {
        // as `%g` of C has it: plain from 0.0001 on, below a million
        (
            format!(
                "{}·{}",
                fixed(shifted(value, -leading), digits - 1),
                raised_power(leading)
            ),
            "",
        )
    } else {
        (fixed(value, places(0)), "")
    };
    if unit.is_empty() {
        text
    } else {
        format!("{text} {prefix}{unit}")
    }
}

/// Digits in groups of three.
///
/// ```
/// assert_eq!(report::grouped(20_000), "20,000");
/// ```
#[must_use]
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number of bytes as people read it: exact below 10,000, else in kB of 1,000 bytes.
///
/// ```
/// assert_eq!(report::bytes(9_999), "9999 B");
/// assert_eq!(report::bytes(31_456), "31.5 kB");
/// ```
#[must_use]
pub fn bytes(count: usize) -> String {
    if count < 10_000 {
        format!("{count} B")
    } else {
        format!("{:.1} kB", count as f64 / 1000.0)
    }
}

/// `value * 10^exponent` with one rounding for a positive and for a negative exponent.
pub fn shifted(value: f64, exponent: i32) -> f64 {
    if exponent < 0 {
        // 10^-3 is no binary number and would be a second rounding; 10^3 is exact, as all up to 10^22
        value / power_of_ten(-exponent)
    } else {
        value * power_of_ten(exponent)
    }
}
