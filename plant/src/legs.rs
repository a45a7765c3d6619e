//! What the inductor is connected to in each state of the leg.

use crate::effects::node_capacitance::Ramp;
use crate::effects::{dcr, dead_time, switch_delay};
use crate::full::Path;
use crate::gates::Gate;
use crate::parameters::{Parameters, Rectifier};
use crate::plain::Drive;
use crate::signals::Signals;
use crate::topology::Shares;

/// The paths of the inductor current, for both integrators.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Legs {
    pub synchronous: bool,
    /// The diode conducts by itself while the output lies below the source.
    pub starts: bool,
    pub main: Drive,
    pub second: Drive,
    pub diode: Drive,
    /// The body diode of the main switch.
    pub body: Drive,
    paths: [Path; 4],
    /// While no current flows.
    open: Path,
    v_f: f64,
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

    fn closed((share, give): Shares, emf: f64, r: f64, only: f64) -> Self {
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
        let (s, topology) = (&p.switch, p.converter.topology);
        let (on, off) = (topology.on(), topology.off());
        let paths = [
            Path::closed(on, 0.0, s.r_ds_on, 0.0),
            Path::closed(off, 0.0, s.r_ds_on_low, 0.0),
            Path::closed(off, -s.v_f, s.r_d, 1.0),
            // a negative current flows back through the body diode of the main switch
            Path::closed(on, s.v_f, s.r_d, -1.0),
        ];
        let (v_in, dcr) = (p.converter.v_in, dcr::in_series(&p.inductor));
        let drive = |path: &Path| as_drive(path, v_in, dcr);
        let starts = topology.starts_by_itself();
        let open = match starts {
            // what the diode sees while it blocks, and the only sign in which a current may begin
            true => Path { open: true, ..paths[2] },
            false => Path::OPEN,
        };
        let (late_on, late_off) = switch_delay::edges(p);
        Legs {
            starts,
            open,
            v_f: s.v_f,
            synchronous: p.converter.rectifier == Rectifier::Synchronous,
            main: drive(&paths[0]),
            second: drive(&paths[1]),
            diode: drive(&paths[2]),
            body: drive(&paths[3]),
            paths,
            v_in,
            dcr,
            lost: (dead_time::hold_back(p) + late_on - late_off) / p.t_sw(),
        }
    }

    /// The path for a state of the gates, a current, and how far the output lies above the source, V.
    pub fn path(&self, gate: Gate, i_l: f64, above: f64) -> Path {
        match gate {
            Gate::Main => self.paths[0],
            Gate::Second => self.paths[1],
            Gate::Neither if i_l > 0.0 => self.paths[2],
            Gate::Neither if i_l < 0.0 => self.paths[3],
            Gate::Neither if self.starts && above < -self.v_f => self.paths[2],
            Gate::Neither => self.open,
        }
    }

    /// Whether the switch node lies at the end of the main switch: that conducts, or its body diode.
    pub fn is_on(&self, path: &Path) -> bool {
        let main = &self.paths[0];
        !path.open && (path.share, path.give) == (main.share, main.give)
    }

    /// What follows a path that ended after `used` seconds while the gates stood still, where the voltages cannot say: they
    /// are equal at that instant, and rounding would ask again and again.
    pub fn after(&self, path: &Path, used: f64) -> Option<Path> {
        match path.open {
            // the output has come down to the source
            true => Some(self.paths[2]),
            // no current would begin
            false if self.starts && used == 0.0 => Some(Path::OPEN),
            false => None,
        }
    }

    /// The paths of a current that leaves `from` when that switch opens: before, and behind the ramp of the node.
    pub fn sides(&self, from: Gate) -> [&Path; 2] {
        match from {
            Gate::Second => [&self.paths[1], &self.paths[3]],
            _ => [&self.paths[0], &self.paths[2]],
        }
    }

    /// Voltage at the inductance along a path, V.
    pub fn v_l(&self, path: &Path, i: f64, signals: &Signals) -> f64 {
        path.share * signals.v_in + path.emf - (path.r + self.dcr) * i - path.give * signals.v_out
    }

    /// The path while the node is between both sides: the output gets what both give it, and the source gives what the node takes.
    pub fn ramp(&self, ramp: &Ramp, i: f64, signals: &Signals) -> Path {
        let [on, off] = [&self.paths[0], &self.paths[1]];
        let share = match ramp.from {
            Gate::Second => on.share.min(off.share),
            _ => on.share,
        };
        let shares = (share, on.give.min(off.give));
        let path = Path::closed(shares, 0.0, 0.0, 0.0);
        Path {
            emf: ramp.v_l - self.v_l(&path, i, signals),
            ..path
        }
    }

    /// The path of the steady state that a duty stands for, with the main switch on or off.
    pub fn steady(&self, on: bool) -> &Path {
        &self.paths[if on { 0 } else { 1 }]
    }

    /// The paths with the main switch off: diode, second switch, body diode of the main switch.
    pub fn off(&self) -> [Path; 3] {
        let [_, second, diode, body] = self.paths;
        [diode, second, body]
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
        let main = &self.paths[0];
        let mean = |of: fn(&Path) -> f64| on * of(main) + (1.0 - on) * of(other);
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
        return Drive {
            starts_below: match path.only != 0.0 {
                true => path.share * v_in + path.emf,
                false => Drive::OPEN.starts_below,
            },
            ..Drive::OPEN
        };
    }
    Drive {
        emf: path.share * v_in + path.emf,
        r: path.r + dcr,
        give: path.give,
        stops_at_zero: path.only != 0.0,
        open: false,
        starts_below: f64::NEG_INFINITY,
    }
}
