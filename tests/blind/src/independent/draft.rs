//! From a board and its records to the files of a case.

use crate::independent::causes::{Variant, variants};
use crate::independent::draw::Design;
use crate::independent::files::{Style, csv, plant};
use crate::independent::instruments::CHANNELS;
use crate::independent::program::{Form, Program, Table, World, exact, measured};
use crate::independent::ties::{Rival, TIED, flat, search, vector};
use crate::independent::truth::{Expect, Family, Hidden, Reducible, Tie, Truth};
use crate::rng::Rng;

/// Path in the folder and text of every file, and what is true.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Path in the folder of the case, text.
    pub files: Vec<(String, String)>,
    /// What `truth.json` says.
    pub truth: Truth,
}

/// A case before it is written.
pub struct Draft {
    /// What the plant file says.
    pub design: Design,
    /// What stands on the bench.
    pub world: World,
    pub programs: Vec<Program>,
    /// Noise-free tables of the world.
    pub exact: Vec<Table>,
    /// What the instruments wrote.
    pub tables: Vec<Table>,
}

impl Draft {
    /// Measures; none where the board does not hold together.
    pub fn measure(design: &Design, world: &World, programs: Vec<Program>, random: &mut Rng) -> Option<Self> {
        let exact: Vec<Table> = programs.iter().map(|program| exact(world, program, random)).collect();
        let limit = 50.0 * design.v_out.max(design.world.board.source.v).max(design.i_l());
        let sound = |table: &Table| {
            table
                .values
                .iter()
                .flatten()
                .all(|value| value.is_finite() && value.abs() < limit)
        };
        if !exact.iter().all(sound) {
            return None;
        }
        let tables = exact.iter().map(|table| measured(world, table, random)).collect();
        Some(Self {
            design: design.clone(),
            world: world.clone(),
            programs,
            exact,
            tables,
        })
    }

    pub fn floors(&self) -> [f64; 6] {
        std::array::from_fn(|index| {
            let floor = self.world.instruments.channels[index].floor();
            if floor > 0.0 { floor } else { 1.0 }
        })
    }

    fn training(&self, tables: &[Table], floors: &[f64; 6]) -> Vec<f64> {
        let pairs = tables
            .iter()
            .zip(&self.programs)
            .filter(|(_, program)| !program.heldout);
        pairs.flat_map(|(table, _)| flat(table, floors)).collect()
    }

    /// Squared distance of the noise-free training records from those of another world.
    pub fn distance(&self, other: &World, floors: &[f64; 6]) -> f64 {
        let here = self.training(&self.exact, floors);
        let there = vector(other, floors, &self.programs);
        here.iter().zip(&there).map(|(a, b)| (a - b) * (a - b)).sum()
    }

    /// [`Draft::distance`] of one channel, less what another gain and offset of its instrument would explain of it.
    pub fn beside_calibration(&self, other: &World, channel: usize) -> f64 {
        let trained = || self.programs.iter().filter(|program| !program.heldout);
        let there: Vec<f64> = trained()
            .flat_map(|program| exact(other, program, &mut Rng::new(0, &[])).values[channel].clone())
            .collect();
        let tables = self
            .exact
            .iter()
            .zip(&self.programs)
            .filter(|(_, program)| !program.heldout);
        let here: Vec<f64> = tables.flat_map(|(table, _)| table.values[channel].clone()).collect();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let (x, y) = (mean(&there), mean(&here));
        let pairs = || there.iter().zip(&here).map(|(a, b)| (a - x, b - y));
        let (cross, own) = pairs().fold((0.0, 0.0), |(cross, own), (a, b)| (cross + a * b, own + a * a));
        let slope = if own > 0.0 { cross / own } else { 0.0 };
        let left: f64 = pairs().map(|(a, b)| (b - slope * a).powi(2)).sum();
        left / self.floors()[channel].powi(2)
    }

    /// Every listed cause fitted to the noise-free training records.
    pub fn rivals(&self, floors: &[f64; 6]) -> Vec<Rival> {
        let all: Vec<Variant> = variants(&self.design);
        let truth = self.training(&self.exact, floors);
        let view = |world: &World| vector(world, floors, &self.programs);
        search(&self.design.world, &all, &truth, &view)
    }

    fn reducible(&self) -> Vec<Reducible> {
        let floors = self.floors();
        let mut all = Vec::new();
        for (table, program) in self
            .exact
            .iter()
            .zip(&self.programs)
            .filter(|(_, program)| program.heldout)
        {
            let nominal = exact(&self.design.world, program, &mut Rng::new(0, &[]));
            for (index, channel) in CHANNELS[..4].iter().enumerate() {
                let (a, b) = (&table.values[index], &nominal.values[index]);
                if a.is_empty() {
                    continue;
                }
                let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
                all.push(Reducible {
                    record: program.name.clone(),
                    channel: (*channel).to_owned(),
                    floor: floors[index],
                    reducible: (square / a.len() as f64).sqrt(),
                });
            }
        }
        all
    }

    /// The converter and the records in a line.
    fn words(&self) -> String {
        let board = &self.design.world.board;
        let channels: Vec<&str> = CHANNELS
            .iter()
            .zip(&self.world.instruments.channels)
            .filter(|(_, channel)| channel.recorded)
            .map(|(name, _)| *name)
            .collect();
        let rows = self
            .programs
            .iter()
            .map(|program| program.periods.len().saturating_sub(program.lead));
        let form = if self.programs[0].form == Form::Settled {
            "settled points"
        } else {
            "rows"
        };
        format!(
            "{}{:?} {:.1} V to {:.1} V, {:.2} A, {:.0} kHz; {} in {:?} {form}",
            if board.stage.synchronous { "synchronous " } else { "" },
            board.topology,
            board.source.v,
            self.design.v_out,
            self.design.i_out,
            1e-3 * board.gates.f_sw,
            channels.join(", "),
            rows.collect::<Vec<_>>(),
        )
    }

    /// The files and the truth. With `search`, looks for what else explains the records; `quiet` channels are left out there.
    pub fn case(
        &self,
        name: Name,
        hidden: Vec<Hidden>,
        mut expect: Expect,
        quiet: &[usize],
        search: bool,
        random: &mut Rng,
    ) -> Case {
        let mut floors = self.floors();
        let chi2 = self.distance(&self.design.world, &floors);
        for index in quiet {
            floors[*index] = f64::INFINITY;
        }
        let rivals = if search { self.rivals(&floors) } else { Vec::new() };
        let ties: Vec<Tie> = rivals
            .iter()
            .filter(|rival| rival.left < TIED)
            .map(|rival| Tie {
                id: rival.id.to_owned(),
                wiring: rival.wiring.to_owned(),
                left: rival.left,
            })
            .collect();
        if expect.must_name {
            for tie in &ties {
                if !expect.causes.contains(&tie.id) {
                    expect.causes.push(tie.id.clone());
                }
            }
        }
        let style = Style::draw(random);
        let written = self.floors();
        let mut files = vec![("plant.toml".to_owned(), plant(&self.design))];
        for (table, program) in self.tables.iter().zip(&self.programs) {
            let folder = if program.heldout { "heldout" } else { "train" };
            files.push((format!("{folder}/{}.csv", program.name), csv(table, style, &written)));
        }
        let truth = Truth {
            world: "independent".to_owned(),
            seed: name.seed,
            case: name.case,
            family: name.family,
            converter: self.words(),
            hidden,
            expect,
            chi2,
            chi2_listed: rivals.first().map_or(chi2, |rival| rival.left),
            ties,
            records: self.reducible(),
        };
        Case { files, truth }
    }
}

/// Which case of which set.
#[derive(Debug, Clone, Copy)]
pub struct Name {
    pub seed: u64,
    pub case: usize,
    pub family: Family,
}
