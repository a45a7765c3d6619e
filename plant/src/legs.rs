//! What the inductor is connected to in each state of the leg.

use crate::effects::{dcr, dead_time, switch_delay};
use crate::full::Path;
use crate::gates::Gate;
use crate::parameters::{Parameters, Rectifier};
use crate::plain::Drive;

/// Shares of the inductor current that the source delivers and the output receives, with the switch on and off.
const ON: (f64, f64) = (1.0, 1.0);
const OFF: (f64, f64) = (0.0, 1.0);

/// The paths of the inductor current, for both integrators.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Legs {
    pub synchronous: bool,
    pub upper: Drive,
    pub lower: Drive,
    pub lower_diode: Drive,
    pub upper_diode: Drive,
    paths: [Path; 4],
    v_in: f64,
    dcr: f64,
    /// Part of the duty that delays take away.
    lost: f64,
}

impl Path {
    pub const OPEN: Path = Path {
        share: 0.0,
        give: 1.0,
        emf: 0.0,
        r: 0.0,
        only: 0.0,
        open: true,
    };

    fn closed((share, give): (f64, f64), emf: f64, r: f64, only: f64) -> Self {
        Path {
            share,
            give,
            emf,
            r,
            only,
            open: false,
        }
    }
}

impl Legs {
    pub fn new(p: &Parameters) -> Self {
        let s = &p.switch;
        let paths = [
            Path::closed(ON, 0.0, s.r_ds_on, 0.0),
            Path::closed(OFF, 0.0, s.r_ds_on_low, 0.0),
            Path::closed(OFF, -s.v_f, s.r_d, 1.0),
            // a negative current flows back into the source, through the upper body diode
            Path::closed(ON, s.v_f, s.r_d, -1.0),
        ];
        let (v_in, dcr) = (p.converter.v_in, dcr::in_series(&p.inductor));
        let drive = |path: &Path| as_drive(path, v_in, dcr);
        let (on, off) = switch_delay::edges(p);
        Legs {
            synchronous: p.converter.rectifier == Rectifier::Synchronous,
            upper: drive(&paths[0]),
            lower: drive(&paths[1]),
            lower_diode: drive(&paths[2]),
            upper_diode: drive(&paths[3]),
            paths,
            v_in,
            dcr,
            lost: (dead_time::hold_back(p) + on - off) / p.t_sw(),
        }
    }

    /// The path for a state of the gates and a current.
    pub fn path(&self, gate: Gate, i_l: f64) -> Path {
        match gate {
            Gate::Upper => self.paths[0],
            Gate::Lower => self.paths[1],
            Gate::Neither if i_l > 0.0 => self.paths[2],
            Gate::Neither if i_l < 0.0 => self.paths[3],
            Gate::Neither => Path::OPEN,
        }
    }

    /// The mean of the paths over a period (equation 2 of the paper, with losses; CCM).
    pub fn averaged(&self, duty: f64) -> Path {
        // a switch that stays off or on has no edges, and so loses no duty
        let on = if duty <= 0.0 || duty >= 1.0 {
            duty
        } else {
            (duty - self.lost).clamp(0.0, 1.0)
        };
        let other = if self.synchronous {
            &self.paths[1]
        } else {
            &self.paths[2]
        };
        let upper = &self.paths[0];
        let mean = |of: fn(&Path) -> f64| on * of(upper) + (1.0 - on) * of(other);
        let (share, give) = (mean(|path| path.share), mean(|path| path.give));
        Path::closed((share, give), (1.0 - on) * other.emf, mean(|path| path.r), 0.0)
    }

    /// The same path for the circuit of two states.
    pub fn drive(&self, path: &Path) -> Drive {
        as_drive(path, self.v_in, self.dcr)
    }
}

fn as_drive(path: &Path, v_in: f64, dcr: f64) -> Drive {
    if path.open {
        return Drive::OPEN;
    }
    Drive {
        emf: path.share * v_in + path.emf,
        r: path.r + dcr,
        give: path.give,
        stops_at_zero: path.only != 0.0,
        open: false,
    }
}
