//! Names that are safe in every language and file system the compiler writes to.

use crate::limits::MAX_NAME_CHARS;

/// Keywords and predefined words of C11, C++20 and the compilers of common controllers.
// `far`, `near`, `interrupt`, `cregister`, `ioport` are words of TI's and other compilers of controllers, `vector` and
// `pixel` of AltiVec; `linux`, `unix`, `i386` are macros that gcc defines in its GNU modes
const C_WORDS: &str = "alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t \
    char32_t class co_await co_return co_yield compl complex concept const const_cast consteval constexpr constinit \
    continue cregister decltype default delete do double dynamic_cast else entry enum explicit export extern false far \
    float for fortran friend goto huge i386 if imaginary inline int interrupt ioport linux long mutable namespace near \
    new noexcept noreturn not not_eq nullptr onchip operator or or_eq pixel private protected public register \
    reinterpret_cast requires restrict return short signed sizeof static static_assert static_cast struct switch \
    template this thread_local throw true try typedef typeid typename typeof typeof_unqual union unix unsigned using \
    vector virtual void volatile wchar_t while xor xor_eq";

/// Names that macros or types of the C library take.
// `real_t`, `int_t`, `boolean_t` and their like are types that Simulink's headers define
const C_LIBRARY: &str = "assert errno fpclassify int8_t int16_t int32_t int64_t int_fast8_t int_fast16_t \
    int_fast32_t int_fast64_t int_least8_t int_least16_t int_least32_t int_least64_t intmax_t intptr_t isfinite isinf \
    isnan isnormal main max_align_t nan inf null offsetof ptrdiff_t setjmp signbit size_t ssize_t stderr stdin stdout \
    uint8_t uint16_t uint32_t uint64_t uint_fast8_t uint_fast16_t uint_fast32_t uint_fast64_t uint_least8_t \
    uint_least16_t uint_least32_t uint_least64_t uintmax_t uintptr_t va_list boolean_t real_t int_t uint_t char_t";

/// Keywords of Rust, reserved ones included, and its primitive types.
const RUST_WORDS: &str = "abstract as async await become box break const continue crate do dyn else enum extern final fn \
    for gen if impl in let loop macro macro_rules match mod move mut override priv pub ref return self static struct \
    super trait try type typeof union unsafe unsized use virtual where while yield f16 f32 f64 f128 i8 i16 i32 i64 \
    i128 isize u8 u16 u32 u64 u128 usize";

/// Names a policy cannot have: modules, files and headers that would be hidden.
// `math.h` of a policy `math` would be included for the system's; `con`, `nul`, `lpt1` are devices of Windows, with any
// extension; `simstruc` is the header of S-functions
const POLICY_CLASHES: &str = "core std alloc test proc_macro self_test init reset step eval commit integrity policy \
    complex ctype fenv float inttypes iso646 limits locale math setjmp signal stdalign stdarg stdatomic stdbool stddef \
    stdint stdio stdlib stdnoreturn string tgmath threads time uchar wchar wctype simstruc con prn aux nul com1 com2 \
    com3 com4 lpt1 lpt2 lpt3 lpt4";

/// What outputs put behind a policy's name: `buck` with an S-function and a policy `buck_block` would share a file and its
/// symbols.
const OUTPUT_ENDINGS: [&str; 10] = [
    "_block",
    "_caller",
    "_ffi",
    "_fmi2",
    "_fmi3",
    "_fmu",
    "_kit",
    "_kit_blocks",
    "_kit_suite",
    "_usr",
];

/// What they put before it.
const OUTPUT_BEGINNINGS: [&str; 3] = ["legacy_", "make_", "sf_"];

/// Names of an expression that are not free.
pub(crate) const REMEMBERED: [&str; 2] = ["previous_duty", "previous_command"];

/// What a name is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Policy,
    Signal,
    Parameter,
    Feature,
    Observer,
    Estimate,
    Output,
    /// What an expression calls a duty of the step before.
    Remembered,
}

impl Kind {
    pub fn word(self) -> &'static str {
        match self {
            Kind::Policy => "policy",
            Kind::Signal => "signal",
            Kind::Parameter => "parameter",
            Kind::Feature => "feature",
            Kind::Observer => "observer",
            Kind::Estimate => "estimate",
            Kind::Output => "output",
            Kind::Remembered => "duty of an output",
        }
    }
}

/// Why `name` cannot be used, as a hint; `None` if it can.
pub(crate) fn objection(name: &str, kind: Kind) -> Option<String> {
    let is = |list: &str| list.split_ascii_whitespace().any(|word| word == name);
    if let Some(hint) = shape(name) {
        return Some(hint);
    }
    if is(C_WORDS) {
        return Some(format!(
            "`{name}` is a keyword or a predefined word of C or C++: try `{name}_value`"
        ));
    }
    if is(RUST_WORDS) {
        return Some(format!("`{name}` is a keyword or a type of Rust: try `{name}_value`"));
    }
    if is(C_LIBRARY) {
        return Some(format!("`{name}` is reserved by the C library: try `{name}_value`"));
    }
    // no expression names a feature, so one may be called `previous_duty`
    if kind != Kind::Feature && REMEMBERED.contains(&name) {
        return Some(format!(
            "`{name}` stands for the controller's own memory in expressions"
        ));
    }
    if kind == Kind::Policy {
        let ending = OUTPUT_ENDINGS.into_iter().find(|end| name.ends_with(end));
        let beginning = OUTPUT_BEGINNINGS.into_iter().find(|begin| name.starts_with(begin));
        if let Some(taken) = ending.or(beginning) {
            return Some(format!(
                "`{taken}` is what files beside another policy's controller are called: try `{name}_policy`"
            ));
        }
    }
    if kind == Kind::Policy && is(POLICY_CLASHES) {
        return Some(format!(
            "a file or module `{name}` would hide an existing one: try `{name}_policy`"
        ));
    }
    None
}

/// The name in letters that are allowed, as far as it has some.
fn plain(name: &str) -> String {
    let plain = |c: char| match c.to_ascii_lowercase() {
        c if c.is_ascii_lowercase() || c.is_ascii_digit() => c,
        _ => '_',
    };
    name.chars().map(plain).collect()
}

fn shape(name: &str) -> Option<String> {
    // no capitals: macros are the name in capitals, so `buck` and `Buck` would share theirs
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if name.is_empty() {
        return Some("the name is empty".to_owned());
    }
    if let Some(c) = name.chars().find(|&c| !allowed(c)) {
        return Some(match c {
            _ if c.is_ascii_uppercase() => format!("write `{}`", plain(name)),
            _ if !c.is_ascii() => format!(
                "`{}` (U+{:04X}) is not ASCII, even if it looks like it",
                c.escape_debug(),
                c as u32
            ),
            _ => format!("the character `{}` is not allowed", c.escape_debug()),
        });
    }
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) {
        return Some("begin with a lower-case letter".to_owned());
    }
    let length = name.len();
    (length > MAX_NAME_CHARS).then(|| format!("{length} characters: shorten it to at most {MAX_NAME_CHARS}"))
}
