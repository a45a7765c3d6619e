//! What can be wrong with a plant file, as it happens on boards and benches: one cause, wired in one of several ways.
//!
//! The ids are the words of the diagnosis; the physics is that of the board.

use crate::independent::draw::Design;
use crate::independent::program::World;
use crate::independent::records::Needs;
use crate::rng::Rng;

mod outside;
mod stage;

type Set = Box<dyn Fn(&mut World, f64) + Send + Sync>;

/// A number that a cause has.
pub struct Knob {
    pub name: &'static str,
    pub unit: &'static str,
    /// What the plant file has.
    pub nominal: f64,
    /// What is drawn.
    pub drawn: (f64, f64),
    /// What is possible.
    pub allowed: (f64, f64),
    /// Whether the size may have either sign around the nominal one: `drawn` is then a distance.
    pub signed: bool,
    set: Set,
}

/// A cause with its wiring.
pub struct Variant {
    pub id: &'static str,
    pub wiring: &'static str,
    pub knobs: Vec<Knob>,
    pub needs: Needs,
}

impl Variant {
    /// The world with these values.
    pub fn applied(&self, world: &World, values: &[f64]) -> World {
        let mut world = world.clone();
        for (knob, value) in self.knobs.iter().zip(values) {
            (knob.set)(&mut world, *value);
        }
        world
    }

    /// Values as they are hidden.
    pub fn draw(&self, random: &mut Rng) -> Vec<f64> {
        let mut draw = |knob: &Knob| {
            let size = random.uniform(knob.drawn.0, knob.drawn.1);
            match knob.signed {
                true if random.chance(0.5) => knob.nominal - size,
                true => knob.nominal + size,
                false => size,
            }
        };
        self.knobs.iter().map(&mut draw).collect()
    }
}

struct List(Vec<Variant>);

impl List {
    fn one(
        &mut self,
        (id, wiring): (&'static str, &'static str),
        (name, unit, nominal): (&'static str, &'static str, f64),
        drawn: (f64, f64),
        set: impl Fn(&mut World, f64) + Send + Sync + 'static,
    ) -> &mut Variant {
        let allowed = (0.0, 10.0 * drawn.1.max(nominal));
        let knob = Knob {
            name,
            unit,
            nominal,
            drawn,
            allowed,
            signed: false,
            set: Box::new(set),
        };
        self.0.push(Variant {
            id,
            wiring,
            knobs: vec![knob],
            needs: Needs::default(),
        });
        let last = self.0.len() - 1;
        &mut self.0[last]
    }
}

impl Variant {
    fn signed(&mut self) -> &mut Self {
        if let Some(knob) = self.knobs.last_mut() {
            knob.signed = true;
            knob.allowed = (knob.nominal - 10.0 * knob.drawn.1, knob.nominal + 10.0 * knob.drawn.1);
        }
        self
    }

    fn and(
        &mut self,
        (name, unit, nominal): (&'static str, &'static str, f64),
        drawn: (f64, f64),
        set: impl Fn(&mut World, f64) + Send + Sync + 'static,
    ) -> &mut Self {
        let allowed = (0.05 * drawn.0, 10.0 * drawn.1);
        self.knobs.push(Knob {
            name,
            unit,
            nominal,
            drawn,
            allowed,
            signed: false,
            set: Box::new(set),
        });
        self
    }

    fn within(&mut self, low: f64, high: f64) -> &mut Self {
        if let Some(knob) = self.knobs.last_mut() {
            knob.allowed = (low, high);
        }
        self
    }

    fn needs(&mut self, power: bool, sink: bool, rows: bool) -> &mut Self {
        self.needs = Needs { power, sink, rows };
        self
    }
}

/// Every cause that can be wired to this design.
pub fn variants(design: &Design) -> Vec<Variant> {
    let mut list = List(Vec::new());
    stage::losses(design, &mut list);
    stage::edges(design, &mut list);
    stage::storage(design, &mut list);
    stage::source(design, &mut list);
    outside::sensors(design, &mut list);
    outside::timing_of_sensors(design, &mut list);
    outside::command(&mut list);
    outside::sink(design, &mut list);
    list.0
}
