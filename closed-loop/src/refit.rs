//! The mapping of a converter for a policy that is to control it: which points, the fit, the policy with it.

use std::path::Path;

use drm::acquire::{Bench, Hold, LoadSetting, Plan, PlanPoint, Protocol, measure};
use drm::formula::Losses;
use drm::{DutyRatioMap, FitOptions, Table, TableOptions};
use plant::{Load, Parameters, Signals};
use policy::{Interval, Policy};
use toml_input::Message;

use crate::environment::{Environment, LoadPath, Start};
use crate::faults::Error;
use crate::load_step::{LoadKind, LoadStep};

/// Voltages that settled points are measured at, over the range of the policy's duties.
// three would fit a plane; two more show whether it bends (`drm fit` leaves each out once)
const VOLTAGES: usize = 5;

/// Share of the held voltage within which points are measured: a policy may have all duties, but stays near it.
// a little wider than the paper's duties, 0.44 to 0.55 of 200 V for 100 V
const BESIDE: f64 = 0.15;

/// An environment as a bench that settled points are measured at.
#[derive(Debug, Clone)]
pub struct AtEnvironment<E>(pub E);

impl<E: Environment> Bench for AtEnvironment<E> {
    type Error = Error;

    fn start(&mut self, v_out: f64, load: &Load) -> Result<Signals, Error> {
        let start = Start {
            v_out,
            i_l: load.conductance * v_out + load.current + load.power / v_out,
            load: *load,
            seed: 0,
            varied: &[],
        };
        Ok(self.0.restart(&start)?.measured)
    }

    fn step(&mut self, duty: f64, load: &Load) -> Result<Signals, Error> {
        let sample = self.0.step(duty, &LoadPath::constant(*load));
        if let Some(error) = self.0.failure() {
            return Err(error);
        }
        // another simulator that has failed has no other way to say so
        match sample.v_out.is_finite() {
            true => Ok(sample.measured),
            false => Err(Message::new("the simulation of the converter failed").into()),
        }
    }
}

/// A policy, what it was trained on, and what it is to hold.
#[derive(Debug, Clone, Copy)]
pub struct Refit<'a> {
    /// The policy.
    pub policy: &'a Policy,
    /// Index of the output whose mapping it is; 0 of a policy with one.
    pub output: usize,
    /// What it was trained on.
    pub nominal: &'a Parameters,
    /// The steady state of that.
    pub trained_on: Losses,
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// Load steps it is to master.
    pub load_steps: &'a [LoadStep],
}

impl Refit<'_> {
    /// Every load of the load steps, once.
    #[must_use]
    pub fn loads(&self) -> Vec<LoadSetting> {
        let mut loads = Vec::new();
        for step in self.load_steps {
            for value in step.values {
                let load = match step.kind {
                    LoadKind::Power => LoadSetting::Power(value),
                    LoadKind::Current => LoadSetting::Current(value),
                    LoadKind::Resistance => LoadSetting::Resistor(value),
                };
                if !loads.contains(&load) {
                    loads.push(load);
                }
            }
        }
        loads
    }

    /// Points to be measured at a converter with `v_in` V: every load at voltages around that to be held, as far as the
    /// policy's duties reach on the converter of its training.
    ///
    /// # Errors
    /// If a load or voltage makes no sense.
    pub fn plan(&self, v_in: f64) -> Result<Plan, Error> {
        let own = self.nominal.converter.v_in;
        let (low, high) = self.duties();
        let low = (low * own).max((1.0 - BESIDE) * self.v_ref);
        // 3 % for what a real converter loses at full duty
        let high = (high * own).min((1.0 + BESIDE) * self.v_ref).min(0.97 * v_in.min(own));
        // for its head only: the points below are voltages to be held, not duties
        let mut plan = Plan::new(own, &[0.5], &[LoadSetting::Current(1.0)], 0.0)?;
        plan.points.clear();
        for load in self.loads() {
            for k in 0..VOLTAGES {
                let v_out = low + (high - low) * k as f64 / (VOLTAGES - 1) as f64;
                let point = PlanPoint {
                    duty: v_out / own,
                    load,
                    // loads of constant power have no stable open loop
                    hold: Hold::ClosedLoop(v_out),
                };
                plan.points.push((point, None));
            }
        }
        Ok(plan)
    }

    /// Measures a point of the plan.
    ///
    /// # Errors
    /// Those of the bench.
    pub fn measure<B: Bench + ?Sized>(
        &self,
        bench: &mut B,
        entry: &mut (PlanPoint, Option<drm::acquire::Measurement>),
    ) -> Result<(), B::Error> {
        entry.1 = Some(measure(bench, self.nominal, &entry.0, &Protocol::default())?);
        Ok(())
    }

    /// Fits a mapping to a measured plan. What is known at the bench beside the table is the converter of the training.
    ///
    /// # Errors
    /// If the points do not determine a mapping.
    pub fn fit(&self, points: &str) -> Result<drm::Report, Error> {
        let options = TableOptions {
            simulation: Some(self.trained_on),
            skip_unsettled: true,
            ..TableOptions::default()
        };
        let table = Table::parse(Path::new("points.csv"), points, &options)?;
        drm::fit(&table, &FitOptions::of(self.nominal))
    }

    /// The policy with another mapping, read from the text of a drm.toml as any other.
    ///
    /// # Errors
    /// If the contract does not allow such a mapping.
    pub fn with(&self, map: &DutyRatioMap) -> Result<Policy, Error> {
        // through its text, so that digits and checks are those of a file
        let mut mapping = policy::read_mapping(Path::new("drm.toml"), &map.to_toml(""))?;
        let own = self.policy.path(self.output).mapping;
        mapping.load_current = own.map_or(0, |mapping| mapping.load_current);
        Ok(self.policy.clone().with_mapping(self.output, mapping))
    }

    /// What no mapping repairs at `real`, in words.
    ///
    /// # Errors
    /// If either converter is none.
    pub fn beyond_repair(&self, real: &Parameters, map: &DutyRatioMap) -> Result<Vec<String>, Error> {
        let limits = Some(self.policy.path(self.output).limits.duty);
        // equal currents, for constant power may not come to rest
        let at_rest = |load: LoadSetting| LoadSetting::Current(load.current(self.v_ref));
        let loads: Vec<LoadSetting> = self.loads().into_iter().map(at_rest).collect();
        let steady = drm::judge::against_plant(map, real, self.nominal, self.v_ref, &loads, limits)?;
        let mut remarks = drm::judge::beyond_repair(&steady, self.v_ref);
        remarks.extend(self.cut_off(map));
        Ok(remarks)
    }

    /// Whether the policy's duty limits cut off what the mapping makes of its actions.
    fn cut_off(&self, map: &DutyRatioMap) -> Option<String> {
        let (low, high) = self.duties();
        let mapped = DutyRatioMap {
            valid_d_sim: Interval { low, high },
            ..*map
        }
        .duty_range();
        let limits = self.policy.path(self.output).limits.duty;
        let (too_low, too_high) = (mapped.low < limits.low, mapped.high > limits.high);
        // 0 and 1 are the ends of any modulator
        (too_low && limits.low > 0.0 || too_high && limits.high < 1.0).then(|| {
            format!(
                "the policy's duties map to {:.4} .. {:.4}, but its limits are {} .. {}: what lies beyond is cut off in \
                 transients; widen them",
                mapped.low, mapped.high, limits.low, limits.high
            )
        })
    }

    /// Smallest and largest duty before the mapping.
    fn duties(&self) -> (f64, f64) {
        let all = self.policy.path(self.output).head.duties().into_iter();
        all.fold((1.0, 0.0), |(low, high), duty| (duty.min(low), duty.max(high)))
    }
}

/// Refuses a policy with an output, by its index, whose duty no mapping can follow.
///
/// # Errors
/// If its contract has no mapping for it.
pub fn needs_mapping(policy: &Policy, output: usize) -> Result<(), Error> {
    let path = policy.path(output);
    if path.mapping.is_none() {
        if let Some(name) = path.name {
            let message = Message::new("this output of the policy has no mapping to transfer with").found(name);
            return Err(message.hint("add `mapping = { file = \"drm.toml\", load_current = \"i_out\" }` to it, and an identity a = 1, b = 0, c = 0").into());
        }
        let hint = "add [mapping] with file = \"drm.toml\" and load_current, and an identity a = 1, b = 0, c = 0";
        return Err(Message::new("the policy has no mapping to transfer with")
            .hint(hint)
            .into());
    }
    Ok(())
}
