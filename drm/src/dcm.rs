//! Where the inductor current rests at zero: settled points there do not follow the mapping.

use plant::{Parameters, Rectifier};

/// What decides between continuous and discontinuous conduction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conduction {
    /// H.
    pub inductance: f64,
    /// Hz.
    pub f_sw: f64,
    /// Forward voltage of the diode, V.
    pub v_f: f64,
}

impl Conduction {
    /// Of a plant; `None` if its current cannot rest, because its leg is synchronous or its model averaged.
    #[must_use]
    pub fn of(plant: &Parameters) -> Option<Self> {
        let diode = plant.converter.rectifier == Rectifier::Diode && plant.converter.model == plant::Model::Switched;
        diode.then_some(Conduction {
            inductance: plant.converter.inductance,
            f_sw: plant.converter.f_sw,
            v_f: plant.switch.v_f,
        })
    }

    /// Load current below which a buck converter with a diode runs discontinuously: half the ripple, A.
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
    fn a_synchronous_leg_has_no_boundary() {
        let mut parameters = Parameters::paper_model();
        parameters.converter.rectifier = Rectifier::Synchronous;
        assert_eq!(Conduction::of(&parameters), None);
    }
}
