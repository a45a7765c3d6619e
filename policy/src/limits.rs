//! Sizes beyond which input is refused, so that neither memory nor generated code can grow without bound.

pub use toml_input::{MAX_SYNTAX_FAULTS, MAX_TOML_BYTES};

// a limit without a reason beside it is a convention; for scale, buck12 has 6 features, 12 actions and layers of 64
/// Longest memory of a filter in samples (`delay`, `moving_average`).
pub const MAX_LINE: usize = 256;
/// Most dense layers of a network: eight hidden ones and the output.
pub const MAX_LAYERS: usize = 9;
/// Most outputs of a layer.
pub const MAX_WIDTH: usize = 1024;
/// Most features (network inputs).
pub const MAX_FEATURES: usize = 64;
/// Most measured signals.
pub const MAX_SIGNALS: usize = 32;
/// Most conditions of a dead zone.
pub const MAX_DEAD_ZONE: usize = 4;
/// Most gains of a law that the network schedules.
pub const MAX_GAINS: usize = 16;
/// Most outputs of a contract: each takes its limits and its state into every step.
pub const MAX_OUTPUTS: usize = 16;
/// Most observers.
pub const MAX_OBSERVERS: usize = 4;
/// Most named parameters.
pub const MAX_PARAMETERS: usize = 64;
/// Fewest discrete actions (network outputs).
pub const MIN_ACTIONS: usize = 2;
/// Most discrete actions (network outputs).
pub const MAX_ACTIONS: usize = 256;
/// Most filters of one feature.
pub const MAX_FILTERS: usize = 8;
// the crate `safetensors` takes 100,000 tensors and headers of 100 MB without a word: these limits are ours
/// Most tensors in a safetensors file.
pub const MAX_TENSORS: usize = 64;
/// Largest safetensors file in bytes (64 MiB).
pub const MAX_WEIGHT_BYTES: u64 = 64 << 20;
/// Largest header of a safetensors file in bytes (1 MiB).
pub const MAX_HEADER_BYTES: u64 = 1 << 20;
/// Longest source expression in characters.
pub const MAX_SOURCE_CHARS: usize = 500;
// the parser recurses: the depth bounds its stack
/// Deepest nesting of parentheses and signs in a source expression.
pub const MAX_SOURCE_DEPTH: usize = 32;
/// Longest name in characters.
pub const MAX_NAME_CHARS: usize = 31;
/// Longest unit text in characters.
pub const MAX_UNIT_CHARS: usize = 16;
/// Longest tensor name in characters.
pub const MAX_TENSOR_NAME_CHARS: usize = 128;
// wide enough for any converter, and narrow enough to catch microseconds or hertz in the place of seconds
/// Shortest control period in seconds.
pub const MIN_SAMPLE_PERIOD: f64 = 1e-9;
/// Longest control period in seconds.
pub const MAX_SAMPLE_PERIOD: f64 = 10.0;
/// Longest time constant of a filter in sample periods; beyond it binary32 cannot follow the slow pole.
// 1 - p is then 1e-6, which is 16 units of p's last place
pub const MAX_TIME_CONSTANT_PERIODS: f64 = 1e6;
/// Largest hold count, in sample periods.
pub const MAX_HOLD: u32 = 1_000_000;
/// Longest soft start in sample periods.
pub const MAX_SOFT_START_STEPS: u32 = 1_000_000;
/// Smallest step of the soft start: below it `fl(cap + step)` stands still near 1 (2^-23 = 1.19e-7).
pub const MIN_SOFT_START_INCREMENT: f64 = 1.2e-7;
/// Largest ADC code: every integer up to here is a binary32 number.
pub const MAX_ADC_CODE: f64 = 16_777_216.0;
/// Largest magnitude of any value inside the controller; a factor of four below the binary32 overflow.
// two such values add up to a finite number, so that bounds may add first and compare afterwards
pub const MAX_MAGNITUDE: f64 = (f32::MAX / 4.0) as f64;
