//! Where the inductor current rests at zero, or turns round in a synchronous leg with dead time: settled points there do
//! not follow the mapping.

use plant::{Parameters, Rectifier};

/// What decides whether the current stays positive throughout the period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conduction {
    /// H.
    pub inductance: f64,
    /// Hz.
    pub f_sw: f64,
    /// Forward voltage of the diode, 0 for a second switch, V.
    pub v_f: f64,
}

impl Conduction {
    /// Of a plant; `None` if the sign of its current decides nothing: in an averaged model, and in a synchronous leg that
    /// loses no duty to dead time.
    #[must_use]
    pub fn of(plant: &Parameters) -> Option<Self> {
        let switch = &plant.switch;
        let edges = [switch.dead_time, switch.turn_on_delay, switch.turn_off_delay];
        let depends = plant.converter.rectifier == Rectifier::Diode || edges != [0.0; 3];
        depends.then(|| Self::of_switched(plant)).flatten()
    }

    /// Of a synchronous leg that loses no duty to dead time, whose current turns round below the boundary and changes nothing
    /// by it; `None` of every other plant.
    #[must_use]
    pub fn of_turning(plant: &Parameters) -> Option<Self> {
        match Self::of(plant) {
            Some(_) => None,
            None => Self::of_switched(plant),
        }
    }

    fn of_switched(plant: &Parameters) -> Option<Self> {
        let converter = &plant.converter;
        (converter.model == plant::Model::Switched).then_some(Conduction {
            inductance: converter.inductance,
            f_sw: converter.f_sw,
            v_f: match converter.rectifier {
                Rectifier::Diode => plant.switch.v_f,
                Rectifier::Synchronous => 0.0,
            },
        })
    }

    /// Load current below which the current of a buck converter rests or turns round: half the ripple, A.
    ///
    /// While the diode carries the current it falls by `(v_out + v_f) (1 - d) / (L f_sw)`, with
    /// `1 - d = (v_in - v_out) / (v_in + v_f)`.
    #[must_use]
    pub fn boundary(&self, v_out: f64, v_in: f64) -> f64 {
        0.5 * (v_out + self.v_f) * (v_in - v_out) / ((v_in + self.v_f) * self.inductance * self.f_sw)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_boundary_is_where_the_plant_begins_to_rest() {
        let parameters = Parameters::paper_model();
        let boundary = Conduction::of(&parameters).unwrap().boundary(100.0, 200.0);
        assert!((boundary - 1.25).abs() < 1e-12, "half of 2.5 A: {boundary}");
        let mut plant = plant::Plant::new(&parameters).unwrap();
        for (share, rests) in [(0.99, true), (1.01, false)] {
            let load = plant::Load::current(share * boundary);
            let settled = plant.settle(100.0, &load);
            assert!(settled.converged);
            assert_eq!(plant.step(settled.duty, &load).discontinuous, rests, "{share}");
        }
    }

    #[test]
    fn a_synchronous_leg_has_a_boundary_where_dead_time_makes_one() {
        let mut parameters = Parameters::paper_model();
        parameters.converter.rectifier = Rectifier::Synchronous;
        assert_eq!(Conduction::of(&parameters), None);
        assert_eq!(Conduction::of_turning(&parameters).map(|leg| leg.v_f), Some(0.0));
        parameters.switch.dead_time = 1e-6;
        assert_eq!(Conduction::of_turning(&parameters), None);
        assert_eq!(Conduction::of(&parameters).map(|conduction| conduction.v_f), Some(0.0));
    }
}
