//! The next experiments as files that a bench can play: a row for each switching period, set at its start and held until the next.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use plant::Load;

use crate::next::Experiment;

/// The folder of the files.
pub const FOLDER: &str = "experiments";
/// Significant digits of what is set: a tenth of what benches resolve, and as the sentences beside say it.
const DIGITS: usize = 6;

/// What a bench sets in an experiment, period by period.
#[derive(Debug, Clone, PartialEq)]
pub struct Played {
    /// Switching period, s.
    pub period: f64,
    /// Duty that is commanded, 1.
    pub duty: Vec<f64>,
    /// What is set at the load; all parts draw together.
    pub load: Vec<Load>,
    /// Source voltage, V.
    pub v_in: f64,
}

impl Played {
    /// The file: each column says its unit, as the [reader of records](measured) takes it.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from("t (s),duty (1),r_load (ohm),i_load (A),p_load (W),v_in (V)\n");
        for (row, (duty, load)) in self.duty.iter().zip(&self.load).enumerate() {
            let numbers = [
                row as f64 * self.period,
                *duty,
                1.0 / load.conductance,
                load.current,
                load.power,
                self.v_in,
            ];
            let _ = writeln!(text, "{}", numbers.map(told).join(","));
        }
        text
    }
}

/// A number without the remains of its binary form.
fn told(number: f64) -> String {
    let rounded: f64 = format!("{number:.*e}", DIGITS - 1).parse().unwrap_or(number);
    // an exponent is read by all readers of records, and by not every lookup table of a bench: Rust writes digits alone
    rounded.to_string()
}

/// Names and texts of the files of `list`, below [`FOLDER`]; none without experiments.
#[must_use]
pub fn files(list: &[Experiment]) -> BTreeMap<String, String> {
    let mut files: BTreeMap<String, String> = list.iter().map(|next| (next.file.clone(), next.played.csv())).collect();
    if let Some(first) = list.first() {
        files.insert(format!("{FOLDER}/README.md"), readme(list, first.played.period));
    }
    files
}

fn readme(list: &[Experiment], period: f64) -> String {
    let mut text = String::from(
        "# Experiments that break the tie\n\n\
         Written by `policyc diagnose`. The records explain themselves in more than one way; each experiment here separates two of these.\n\n\
         | file | what | separates | separation |\n|---|---|---|---|\n",
    );
    for next in list {
        let name = next.file.rsplit('/').next().unwrap_or(&next.file);
        let [one, other] = &next.separates;
        let _ = writeln!(
            text,
            "| `{name}` | {} | {one} from {other} | {:.1} |",
            next.experiment, next.separation
        );
    }
    let _ = write!(
        text,
        "\nSeparation counts standard deviations between the two explanations with the noise of your records. One experiment for each \
         pair is enough.\n\n\
         ## The files\n\n\
         A row is a switching period of {} s. It is set at its time `t` and held until the next row. Units stand in the header: `duty` \
         from 0 to 1; `r_load`, `i_load` and `p_load` are a resistor, a current and a constant power that draw together; `v_in` is the \
         voltage of the source.\n\n\
         ## At the bench\n\n\
         1. Look whether converter, source and load bear what the file asks for. It was chosen for what it tells, not for what your bench \
         bears.\n\
         2. Set the first row, and wait until nothing moves.\n\
         3. Play the rows, and record the channels that you recorded before, a row for each period.\n\
         4. Put the measured columns beside those of the file. Where `v_in` was not measured, leave its column out.\n\
         5. Run the same `policyc diagnose` with the old records and the new one behind `--train`.\n",
        told(period)
    );
    text
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use measured::{ColumnMap, Sheet};
    use plant::{Load, Parameters};

    use super::{Played, told};
    use crate::record::Record;

    /// With the measured columns beside it the file is a record, as its page says.
    #[test]
    fn a_played_experiment_is_read_back_as_a_record() {
        let load = |n: usize| Load {
            conductance: 0.05,
            current: [0.0, 2.5][n / 30],
            power: 0.0,
        };
        let played = Played {
            period: 1e-4,
            duty: (0..60).map(|n| [0.45, 0.55][n / 20 % 2]).collect(),
            load: (0..60).map(load).collect(),
            v_in: 200.0,
        };
        let measured = |(n, line): (usize, &str)| match n {
            0 => format!("{line},v_out\n"),
            _ => format!("{line},{}\n", 100.0 + 0.1 * (n % 7) as f64),
        };
        let text: String = played.csv().lines().enumerate().map(measured).collect();
        let sheet = Sheet::parse(Path::new("duty-steps.csv"), text.into(), &Record::file_options()).unwrap();
        let record = Record::read(&sheet, &ColumnMap::default(), &Parameters::paper_table()).unwrap();
        assert_eq!((&record.duty, &record.load), (&played.duty, &played.load));
    }

    #[test]
    fn numbers_are_written_in_digits_without_binary_remains() {
        assert_eq!(told(3.0 * 1e-4), "0.0003");
        assert_eq!(told(1.0 / 0.05), "20");
        assert_eq!(told(0.0), "0");
        assert_eq!(told(1e-6 / 3.0), "0.000000333333");
        assert_eq!(told(1234.5678), "1234.57");
    }
}
