//! The files.

use closed_loop::LoadStep;
use closed_loop::design::rounded;
use closed_loop::limit::Limit;

use super::base::Base;
use super::{Channel, Start, WHOLE};

/// Name of the training file.
pub const TRAINING: &str = "train.toml";
/// Name of the scenario.
pub const SCENARIO: &str = "scenario.toml";

// The scales are those of examples/train/measured, whose features, bands and dead zone were tuned on the converter of the paper,
// as shares of its smallest deviation of 1.6 V and its load step of 8 A.

/// Multiplications of a step: the features of the contract, the hidden layers of the training file, the offsets.
pub const MULTIPLICATIONS: usize = 5 * 64 + 64 * 64 + 64 * 13;
/// Control periods behind a load step, as a scenario has by default.
const USUAL_AFTER: usize = 300;
/// How many times the smallest deviation and the shortest settling are allowed, the latter with some periods beside it: for the whole load steps, and
/// for those from and to the middle, where a law of control spends less than its full effort. There the laws of 22 converters deviate by up to
/// 1.85 of what nothing can beat, and two networks that had not been asked for such steps by 2.1.
const OF_WHOLE: [f64; 2] = [1.1, 2.0];
const OF_HALF: [f64; 2] = [2.0, 3.0];
/// Of that converter, V and A.
const MODEL: [f64; 2] = [1.6, 8.0];

impl Start {
    /// The contract.
    #[must_use]
    pub fn contract(&self) -> String {
        let base = &self.base;
        let (v_ref, surplus, voltage) = (self.wanted.v_ref, base.surplus(), base.voltage());
        let error = format!("{voltage} - v_ref");
        let [volts, amperes] = [MODEL[0] / self.deviation(), MODEL[1] / self.step()];
        let largest = self.wanted.loads[1] / v_ref;
        let [low, high] = self.duties;
        format!(
            "# A controller for {}, made by `policyc new --plant`. {}\n\
             name = \"controller\"\n\
             sample_period = {:?}                # s: control and PWM period\n\
             \n\
             [parameters]\n\
             v_ref = {v_ref:?}\n\
             \n\
             {}\n\
             {}\
             {}\n\
             {}\n\
             {}\
             [network]\n\
             weights = \"weights.safetensors\"       # `policyc train` writes both\n\
             hidden_activation = \"relu\"\n\
             golden = \"golden.safetensors\"\n\
             \n\
             [actions]                              # the law's duty, and what each output of the network adds to it\n\
             base = \"{}\"\n\
             offsets = [-0.5, -0.2, -0.1, -0.05, -0.02, -0.01, 0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5]\n\
             dead_zone = [                          # nothing is added here: the law alone brings it to rest\n    \
                 {{ source = \"{error}\", within = {:?} }},\n    \
                 {{ source = \"{surplus}\", within = {:?} }},\n\
             ]\n\
             \n\
             [limits]\n\
             duty = [{low:?}, {high:?}]\n\
             initial_duty = {:?}\n\
             \n\
             [fallback]\n\
             duty = 0.0\n\
             hold = 3                               # periods that a bad sample is bridged\n",
            self.converter(),
            base.story(),
            base.nominal().period,
            self.v_out.signal("v_out", "V"),
            match (&self.base, self.i_l) {
                (Base::Measured { .. }, Some(channel)) => format!("{}\n", channel.signal("i_l", "A")),
                _ => String::new(),
            },
            self.i_out.signal("i_out", "A"),
            self.observer(),
            [
                feature("e", &error, rounded(volts, 3), [-5.0, 5.0]),
                feature("e_fine", &error, rounded(6.7 * volts, 3), [-2.0, 2.0]),
                feature("i_c", &surplus, rounded(0.3 * amperes, 3), [-5.0, 5.0]),
                feature("i_c_fine", &surplus, rounded(2.0 * amperes, 3), [-2.0, 2.0]),
                feature("i_out", "i_out", rounded(2.0 / largest, 3), [-2.0, 4.0])
                    .replace("clip", "offset = -1.0\nclip"),
            ]
            .concat(),
            base.law(),
            rounded(0.25 / volts, 2),
            rounded(1.0 / amperes, 2),
            rounded(base.nominal().rest, 3),
        )
    }

    /// The observer, with the reason for its gain of the bias where that is not the usual one.
    fn observer(&self) -> String {
        let table = self.base.observer();
        match self.bias {
            1.0 => table,
            times => format!(
                "# the bias follows faster than usual ({times} times the usual noise of the model): so the law alone settles\n\
                 # soonest where losses move it with the load, or a diode that blocks leaves it wrong\n{table}"
            ),
        }
    }

    /// The training file; `contract` and `plant` are paths as seen from its folder.
    #[must_use]
    pub fn training(&self, contract: &str, plant: &str) -> String {
        let [low, high] = self.wanted.loads;
        let volts = self.deviation() / MODEL[0];
        let bands = [(0.03, 1.0), (0.1, 0.5), (0.3, 0.2), (1.0, 0.1)];
        let bands = bands.map(|(band, reward)| format!("[{:?}, {reward:?}]", rounded(band * volts, 2)));
        // other powers than the evaluation
        let [inner_low, inner_high] = [
            rounded(low + 0.01 * (high - low), 4),
            rounded(high - 0.01 * (high - low), 4),
        ];
        let middle = self.wanted.middle();
        let inner_middle = self.wanted.within(0.45);
        let steps = |low: f64, middle: f64, high: f64| {
            format!(
                "[[{low:?}, {high:?}], [{high:?}, {low:?}], [{low:?}, {middle:?}], [{middle:?}, {low:?}], [{middle:?}, {high:?}],\n              \
                 [{high:?}, {middle:?}]]"
            )
        };
        format!(
            "# Trains {contract} on the plant, made by `policyc new --plant`.\n\
             plant = {plant:?}\n\
             contract = {contract:?}\n\
             seeds = [0, 1, 2]\n\
             steps = 10000                  # control periods at most; `early_stop = false` uses them all\n\
             {}\
             \n\
             [network]\n\
             hidden = [64, 64]\n\
             \n\
             [learning]\n\
             final_learning_rate = 5e-5\n\
             discount = 0.95\n\
             target_update = {{ soft = 2e-3 }}\n\
             epsilon = {{ start = 1.0, end = 0.02, steps = 5000 }}\n\
             \n\
             [reward]\n\
             v_ref = {:?}\n\
             bands = [{}]    # |error| in V at most, reward\n\
             error_weight = {:?}             # taken off per volt\n\
             \n\
             [episode]\n\
             load_every = 50\n\
             any_phase = true               # loads change anywhere in a period\n\
             loads = {{ values = [{low:?}, {middle:?}, {high:?}], range = [{low:?}, {high:?}], share = 0.5 }}    # W\n\
             \n\
             [[randomise]]                  # components are not what their print says\n\
             key = \"converter.inductance\"\n\
             factor = [0.85, 1.15]\n\
             \n\
             [[randomise]]\n\
             key = \"converter.capacitance\"\n\
             factor = [0.85, 1.15]\n\
             \n\
             [selection]                    # on these load steps the best policy is kept\n\
             every = 120\n\
             margin = 0.95                  # other load steps and more instants will be a little worse\n\
             load_steps = {}\n\
             sampling_instants = 2\n\
             instants = 12\n\
             lead = 150\n\
             after = {}\n\
             tail = 60\n\
             \n\
             [evaluation]                   # on these it is judged\n\
             load_steps = {}\n\
             {}\
             \n\
             {}\
             {}",
            self.set(),
            self.wanted.v_ref,
            bands.join(", "),
            rounded(1.0 / volts, 2),
            steps(inner_low, inner_middle, inner_high),
            self.after().unwrap_or(USUAL_AFTER),
            steps(low, middle, high),
            self.after_line(),
            self.specification("[[spec]]", &self.limits.nominal, 10, ""),
            self.elsewhere(),
        )
    }

    /// The tables `[[spread]]`.
    fn elsewhere(&self) -> String {
        let table = |(factor, limits): &(f64, Vec<(LoadStep, Limit)>)| {
            format!(
                "\n[[spread]]                     # it has to hold here as well; the limit is another one\n\
                 factor = {{ \"converter.inductance\" = {factor:?}, \"converter.capacitance\" = {factor:?} }}\n\
                 \n\
                 {}",
                self.specification("[[spread.spec]]", limits, 60, self.base.why_longer()),
            )
        };
        self.limits.spread.iter().map(table).collect()
    }

    /// What a good policy does on each load step: an allowance that they share would let it be spoilt on the easier ones.
    fn specification(&self, title: &str, limits: &[(LoadStep, Limit)], periods: u32, why: &str) -> String {
        let table = |(number, (step, limit)): (usize, &(LoadStep, Limit))| {
            let [from, to] = step.values;
            let [times, longer] = if number < WHOLE { OF_WHOLE } else { OF_HALF };
            format!(
                "{title}\n\
                 load_step = [{from:?}, {to:?}]\n\
                 deviation = {:?}             # V: {times} of what no controller can beat\n\
                 settling = {:?}              # s: {longer} of that, and {periods} periods{}{why}\n\
                 tail = {:?}                  # V\n",
                rounded(times * limit.worst.deviation, 3),
                self.most_settling(longer * limit.worst.settling, periods),
                self.base.patience_in_words(),
                self.most_tail(),
            )
        };
        limits.iter().enumerate().map(table).collect::<Vec<_>>().join("\n")
    }

    /// Control periods behind a load step, where the usual ones are not enough for the law to come to rest before the tail.
    fn after(&self) -> Option<usize> {
        let patience = self.base.patience();
        (patience > 0.0).then(|| USUAL_AFTER + (patience / 50.0).ceil() as usize * 50)
    }

    fn after_line(&self) -> String {
        let line = |after| format!("after = {after}                    # periods: its voltage loop is slow\n");
        self.after().map_or_else(String::new, line)
    }

    /// s; `settling`, and some periods.
    fn most_settling(&self, settling: f64, periods: u32) -> f64 {
        let granted = (f64::from(periods) + self.base.patience()) * self.base.nominal().period;
        rounded(settling + granted, 3)
    }

    /// V; an estimate is hardly finer than its sensor.
    fn most_tail(&self) -> f64 {
        rounded(f64::max(1e-3 * self.wanted.v_ref, 3.0 * self.base.noise()), 3)
    }

    /// The scenario; `plant` is the plant's path, as seen from its folder.
    #[must_use]
    pub fn scenario(&self, plant: &str) -> String {
        let [low, high] = self.wanted.loads;
        let off = |x: f64| rounded(0.85 * x, 4);
        format!(
            "# Load steps with the trained policy, made by `policyc new --plant`. Its law stands beside it, {}\n\
             plant = {plant:?}\n\
             load_steps = [[{low:?}, {high:?}], [{high:?}, {low:?}]]    # W\n\
             baselines = [{}]\n\
             {}\
             {}\
             {}\
             # on a converter whose parts are 15 % smaller than their print says:\n\
             # \"converter.inductance\" = {:?}\n\
             # \"converter.capacitance\" = {:?}\n",
            self.base.beside_it(),
            self.base.baselines(),
            self.limit_line(),
            self.after_line(),
            match self.set() {
                none if none.is_empty() => "\n[set]\n".to_owned(),
                some => some,
            },
            off(self.base.nominal().inductance),
            off(self.base.nominal().capacitance),
        )
    }

    /// A limit of all duties alone is one of another controller, where those of the contract end below 1.
    fn limit_line(&self) -> String {
        let [low, high] = self.duties;
        match high < 1.0 {
            true => format!(
                "limit = [[{low:?}, {high:?}], [0.0, 1.0]]    # duties that it may use: those of the contract, and all\n"
            ),
            false => String::new(),
        }
    }

    fn converter(&self) -> String {
        let base = &self.base;
        let [low, high] = self.wanted.loads;
        let (v_in, v_ref, kilohertz) = (
            base.nominal().v_in,
            self.wanted.v_ref,
            rounded(1e-3 / base.nominal().period, 4),
        );
        format!(
            "a {} converter from {v_in} V to {v_ref} V at {kilohertz} kHz, {low} to {high} W",
            base.nominal().topology.word()
        )
    }

    /// The table `[set]`, if sensors were assumed.
    fn set(&self) -> String {
        let channels = [
            Some(("v_out", "V", self.v_out)),
            Some(("i_out", "A", self.i_out)),
            self.i_l.map(|channel| ("i_l", "A", channel)),
        ];
        let assumed = channels.iter().flatten().filter_map(|(name, unit, channel)| {
            let [step, noise] = channel.assumed?;
            Some(format!(
                "\"sensors.{name}.lsb\" = {step:?}    # {unit}: assumed, 12 bits for {} {unit}\n\
                 \"sensors.{name}.noise\" = {:?}    # {unit}, standard deviation: assumed\n",
                channel.range[1],
                rounded(noise, 2),
            ))
        });
        let lines: String = assumed.collect();
        match lines.is_empty() {
            true => lines,
            false => format!("\n[set]                          # of the plant, which does not know them\n{lines}"),
        }
    }
}

impl Channel {
    fn signal(&self, name: &str, unit: &str) -> String {
        let [low, high] = self.range;
        format!("[[signal]]\nname = \"{name}\"\nunit = \"{unit}\"\nrange = [{low:?}, {high:?}]\n")
    }
}

fn feature(name: &str, source: &str, scale: f64, [low, high]: [f64; 2]) -> String {
    format!("[[feature]]\nname = \"{name}\"\nsource = \"{source}\"\nscale = {scale:?}\nclip = [{low:?}, {high:?}]\n\n")
}
