//! Converters of two states, as power series side by side.

use super::commands::{Drawn, Modulator};
use crate::lane::{LANES, Lane, Mask};
use crate::plain::{All, Give, LARGEST_CHANGE, LONGEST_STEP, ORDER, Part, Plain, TERM_BEFORE, series, sum};
use crate::plant::Plant;
use crate::signals::Load;

/// The constants of `LANES` converters.
#[derive(Debug, Clone)]
pub(super) struct Group {
    t_sw: Lane,
    inv_l: Lane,
    inv_c: Lane,
    longest: Lane,
    last_term: Lane,
    v_fold: Lane,
    emf_on: Lane,
    r_on: Lane,
    emf_off: Lane,
    r_off: Lane,
    give_on: Lane,
    give_off: Lane,
    /// The output of every lane receives all of the current all the time.
    all: bool,
    /// 1 where a diode ends the current.
    diode: Lane,
    plains: [Plain; LANES],
    v_in: Lane,
    drawn: Drawn,
    modulator: Modulator,
}

impl Group {
    pub fn new(plants: &[Plant]) -> Self {
        let lane = |of: &dyn Fn(&Plant) -> f64| Lane(std::array::from_fn(|n| of(&plants[n])));
        // the upper diode has no lane: a current that is not positive makes its lane irregular (`flows` below)
        let off = |p: &Plant| {
            if p.legs.synchronous {
                p.legs.second
            } else {
                p.legs.diode
            }
        };
        let (give_on, give_off) = (lane(&|p| p.legs.main.give), lane(&|p| off(p).give));
        Group {
            all: give_on.0.iter().chain(&give_off.0).all(|give| *give == 1.0),
            give_on,
            give_off,
            t_sw: lane(&|p| p.t_sw),
            inv_l: lane(&|p| p.plain.inv_l),
            inv_c: lane(&|p| p.plain.inv_c),
            longest: lane(&|p| p.plain.longest),
            last_term: lane(&|p| p.plain.last_term),
            v_fold: lane(&|p| p.plain.v_fold),
            emf_on: lane(&|p| p.legs.main.emf),
            r_on: lane(&|p| p.legs.main.r),
            emf_off: lane(&|p| off(p).emf),
            r_off: lane(&|p| off(p).r),
            diode: lane(&|p| if p.legs.synchronous { 0.0 } else { 1.0 }),
            plains: std::array::from_fn(|n| plants[n].plain.clone()),
            v_in: lane(&|p| p.parameters.converter.v_in),
            drawn: Drawn::new(plants),
            modulator: Modulator::new(plants),
        }
    }

    /// Output voltage, inductor current, load current and input voltage at the end of a period.
    #[inline(always)]
    pub fn signals(&self, lanes: &Lanes) -> [Lane; 4] {
        let i_out = Lane::each(|n| {
            let drawn = Load {
                conductance: lanes.conductance.0[n],
                current: lanes.current.0[n],
                power: lanes.power.0[n],
            };
            self.plains[n].load_current(&drawn, lanes.v.0[n])
        });
        [lanes.v, lanes.i, i_out, self.v_in]
    }
}

/// One period of [`LANES`] converters. A lane that needs more than one series a segment is not regular.
pub(super) struct Lanes {
    pub i: Lane,
    pub v: Lane,
    on: Lane,
    conductance: Lane,
    current: Lane,
    power: Lane,
    pub regular: Mask,
}

impl Lanes {
    /// From `i` A and `v` V.
    #[inline(always)]
    pub fn run(group: &Group, [i, v]: [Lane; 2], duties: &[f64], loads: &[Load]) -> Self {
        let [conductance, current, power] = group.drawn.of(loads);
        let mut lanes = Lanes {
            i,
            v,
            on: group.modulator.duties(duties) * group.t_sw,
            conductance,
            current,
            power,
            regular: [1; LANES],
        };
        let off = group.t_sw - lanes.on;
        // no branch for duties of 0 and 1: an interval of length 0 leaves current and voltage as they are, to the bit
        let no_diode = Lane([0.0; LANES]);
        if group.all {
            lanes.segment(All, group, lanes.on, [group.emf_on, group.r_on], no_diode);
            lanes.segment(All, group, off, [group.emf_off, group.r_off], group.diode);
        } else {
            lanes.segment(
                Part(group.give_on),
                group,
                lanes.on,
                [group.emf_on, group.r_on],
                no_diode,
            );
            lanes.segment(
                Part(group.give_off),
                group,
                off,
                [group.emf_off, group.r_off],
                group.diode,
            );
        }
        lanes
    }

    #[inline(always)]
    fn segment<G: Give<Lane>>(&mut self, give: G, group: &Group, h: Lane, drive: [Lane; 2], diode: Lane) {
        let (i0, v0, power) = (self.i, self.v, self.power);
        let mut w0 = Lane([0.0; LANES]);
        for n in 0..LANES {
            // 1 / v0 at a voltage of 0 would bring 0 * inf, a NaN, into a lane without constant power
            let inverse = 1.0 / v0.0[n];
            w0.0[n] = if v0.0[n] < group.v_fold.0[n] { 0.0 } else { inverse };
        }
        let (a, b) = (h * group.inv_l, h * group.inv_c);
        let load = [self.conductance, self.current, power];
        let (i, v) = series(give, [i0, v0, w0], [a, b], drive, load);
        (self.i, self.v) = (sum(&i), sum(&v));
        let rate = b * self.conductance;
        for n in 0..LANES {
            let fold = group.v_fold.0[n];
            // the conditions of `Plain::leaf`, so that a lane that passes has the bits of a plant alone
            let steady = (v[1].0[n].abs() <= LARGEST_CHANGE * v0.0[n]) & (v0.0[n] >= fold) & (self.v.0[n] >= fold);
            let smooth = (power.0[n] == 0.0) | steady;
            let short = (h.0[n] <= group.longest.0[n]) & (rate.0[n] <= LONGEST_STEP);
            let flows = (diode.0[n] == 0.0) | ((i0.0[n] > 0.0) & (self.i.0[n] > 0.0));
            let last = v[ORDER].0[n].abs() + TERM_BEFORE * v[ORDER - 1].0[n].abs();
            self.regular[n] &= u64::from(smooth & short & flows & (last <= group.last_term.0[n]));
        }
    }
}
