//! Converters of inductor and output capacitor with an ESR, side by side: one control period of [`Few`] in each lane.
//!
//! ```text
//! 0        dead          on        on + dead                      t_sw
//! |─ diode ─|──── main ───|─ diode ─|──── second switch ────────────|     synchronous leg
//! |─ diode ─|──── main ───|───────────── diode ─────────────────────|     diode leg
//! ```
//!
//! Where the current of a diode ends, the rest of its interval has an open leg. Invariant: a lane that is regular has the bits of the walk.
//! Not regular is what has another row of intervals than the drawing, an open leg that may conduct by itself or a voltage near the fold of
//! a constant power; whoever asked steps it as a plant alone.

mod search;

use self::search::Search;
use super::few::Few;
use super::{I_L, V_C};
use crate::batch::commands::{Drawn, Modulator};
use crate::catalogue;
use crate::entry::Way;
use crate::full::Path;
use crate::lane::{LANES, Lane, Mask, mask};
use crate::plain::Number;
use crate::plant::Plant;
use crate::rate::OTHER_STEP;
use crate::signals::Load;
use crate::walk::SAME;

/// Effects beyond those of [`Way::Batch`] that a lane can have.
const KNOWN: [&str; 5] = ["esr", "esl", "core_loss", "source_impedance", "dead_time"];

/// Whether lanes hold such a plant.
pub(crate) fn hold(plant: &Plant) -> bool {
    let p = plant.parameters();
    let mut on = catalogue::effects().filter(|effect| effect.is_on(p));
    plant.way == Way::Full
        && on.all(|effect| effect.needs <= Way::Batch || KNOWN.contains(&effect.name))
        && Few::new(&plant.full, &Path::OPEN, &Load::default()).is_some()
}

/// What [`Few`] knows of a path without its load, lane by lane.
#[derive(Debug, Clone, Copy)]
struct Leg {
    drive: Lane,
    r: Lane,
    give: Lane,
    share_r: Lane,
    shrunk: Lane,
    reflected: Lane,
    /// Of the equation of the output voltage, without the load.
    slope: Lane,
    /// The sign of the current that it lets through; 0 for both.
    only: Lane,
}

impl Leg {
    fn new(plants: &[Plant], path: impl Fn(&Plant) -> Path) -> Self {
        let none = Load::default();
        let few = |of: &dyn Fn(&Few<'_>) -> f64| {
            Lane::each(|n| Few::new(&plants[n].full, &path(&plants[n]), &none).map_or(f64::NAN, |few| of(&few)))
        };
        Leg {
            drive: few(&|few| few.drive),
            r: few(&|few| few.r),
            give: few(&|few| few.give),
            share_r: few(&|few| few.share_r),
            shrunk: few(&|few| few.shrunk),
            reflected: few(&|few| few.reflected),
            slope: few(&|few| few.slope),
            only: Lane::each(|n| path(&plants[n]).only),
        }
    }

    /// `other` where `mask` is 0.
    #[inline(always)]
    fn or(&self, mask: &Mask, other: &Leg) -> Leg {
        Leg {
            drive: self.drive.or(mask, other.drive),
            r: self.r.or(mask, other.r),
            give: self.give.or(mask, other.give),
            share_r: self.share_r.or(mask, other.share_r),
            shrunk: self.shrunk.or(mask, other.shrunk),
            reflected: self.reflected.or(mask, other.reflected),
            slope: self.slope.or(mask, other.slope),
            only: self.only.or(mask, other.only),
        }
    }
}

/// The constants of [`LANES`] converters.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    main: Leg,
    diode: Leg,
    body: Leg,
    /// What conducts last: the second switch, or the diode.
    last: Leg,
    /// No current flows.
    open: Leg,
    /// An open leg may conduct by itself.
    starts: Mask,
    synchronous: Mask,
    /// Some lane has a dead time.
    is_dead: bool,
    dead: Lane,
    /// The inductance's current is that of the winding.
    has_core: bool,
    core: Lane,
    esr: Lane,
    v_fold: Lane,
    v_source: Lane,
    per_l: Lane,
    per_c: Lane,
    capacitance: Lane,
    rate: Lane,
    t_sw: Lane,
    drawn: Drawn,
    modulator: Modulator,
}

impl Group {
    pub fn new(plants: &[Plant]) -> Self {
        let [diode, second] = [0, 1].map(|at| Leg::new(plants, |p| p.legs.off()[at]));
        let synchronous = mask(|n| plants[n].legs.synchronous);
        let dead = Lane::each(|n| plants[n].parameters().switch.dead_time);
        let core = Lane::each(|n| plants[n].full.p.inductor.core_conductance);
        let linear = |at: usize| Lane::each(|n| plants[n].full.linear[at].unwrap_or(f64::NAN));
        Group {
            main: Leg::new(plants, |p| *p.legs.steady(true)),
            body: Leg::new(plants, |p| p.legs.off()[2]),
            last: second.or(&synchronous, &diode),
            // of no voltage at the inductor all is 0
            open: Leg {
                shrunk: Lane::of(0.0),
                ..Leg::new(plants, |_| Path::OPEN)
            },
            starts: mask(|n| plants[n].legs.starts),
            diode,
            synchronous,
            is_dead: dead.largest() > 0.0,
            dead,
            has_core: core.0.iter().any(|core| *core != 0.0),
            core,
            esr: Lane::each(|n| plants[n].full.p.capacitor.esr),
            v_fold: Lane::each(|n| plants[n].full.p.load.v_fold),
            v_source: Lane::each(|n| plants[n].full.p.converter.v_in),
            per_l: linear(I_L),
            per_c: linear(V_C),
            capacitance: Lane::each(|n| plants[n].full.p.converter.capacitance),
            rate: Lane::each(|n| plants[n].full.rate),
            t_sw: Lane::each(|n| plants[n].t_sw),
            drawn: Drawn::new(plants),
            modulator: Modulator::new(plants),
        }
    }
}

/// One period of [`LANES`] converters.
pub(crate) struct Lanes<'a> {
    group: &'a Group,
    /// Current of the inductance, A; voltage of the capacitance, V.
    pub x: [Lane; 2],
    pub regular: Mask,
    conductance: Lane,
    current: Lane,
    power: Lane,
    /// Steps per second that are asked for.
    rate: Lane,
}

/// `slope v + esr P / v = right` of a path: `4 slope esr P`, what is off `right`, `2 slope`.
struct Equation {
    four: Lane,
    fixed: Lane,
    twice: Lane,
    /// Every slope is 1, and half is the quotient to the bit: divisions are what a step costs most.
    is_plain: bool,
}

/// [`Few::algebra`] of all lanes.
#[derive(Clone, Copy)]
struct Algebra {
    /// Under the root of the output voltage's equation.
    square: Lane,
    v_out: Lane,
    i_out: Lane,
    i_b: Lane,
    slopes: [Lane; 2],
}

impl<'a> Lanes<'a> {
    /// From `x`, the current of the inductance and the voltage of the capacitance; `clear` are the lanes whose gates owe nothing. Returns
    /// what is true at the end as well: output voltage, winding current, load current, input voltage.
    #[inline(always)]
    pub fn run(group: &'a Group, x: [Lane; 2], clear: Mask, duties: &[f64], loads: &[Load]) -> (Self, [Lane; 4]) {
        let [conductance, current, power] = group.drawn.of(loads);
        // `rate::of_load`
        let far = conductance / group.capacitance / Lane::of(OTHER_STEP);
        let mut lanes = Lanes {
            group,
            x,
            regular: clear,
            conductance,
            current,
            power,
            rate: Lane::each(|n| group.rate.0[n].max(far.0[n])),
        };
        let on = group.modulator.duties(duties) * group.t_sw;
        let [dead, over] = lanes.edges(on);
        let ended = lanes.conduct([dead, on - dead, over - on, group.t_sw - over]);
        let last = group.open.or(&ended, &group.last);
        let end = lanes.algebra(&last, &lanes.equation(&last));
        lanes.agree(&end, &[1; LANES]);
        let v_in = group.v_source - last.share_r * end.i_b;
        (lanes, [end.v_out, end.i_b, end.i_out, v_in])
    }

    /// The intervals of the drawing; the lanes in which the current ended in the last of them, or had ended before.
    // one place that advances, in a loop: all of it is inlined for three widths of vectors, and a copy for each interval took the compiler
    // nine minutes
    #[inline(always)]
    fn conduct(&mut self, lengths: [Lane; 4]) -> Mask {
        let group = self.group;
        let (mut ended, mut at, mut rest) = ([0; LANES], 0, None);
        while at < lengths.len() {
            if !group.is_dead && at % 2 == 0 {
                at += 1;
                continue;
            }
            let i = self.x[I_L];
            let (leg, h) = match (rest, at) {
                (Some(rest), _) => (group.open, rest),
                (None, 1) => (group.main, lengths[1]),
                (None, 3) => (group.last, lengths[3]),
                (None, _) => (group.diode.or(&mask(|n| i.0[n] > 0.0), &group.body), lengths[at]),
            };
            let mut stopped = mask(|n| (leg.only.0[n] != 0.0) & (i.0[n] == 0.0) & (h.0[n] > 0.0));
            let used = self.advance(&leg, h, &mut stopped);
            if rest.is_none() {
                ended = stopped;
                if ended != [0; LANES] {
                    for (regular, (ended, starts)) in self.regular.iter_mut().zip(ended.iter().zip(&group.starts)) {
                        *regular &= 1 - (ended & starts);
                    }
                    // the same interval once more
                    rest = Some((h - used).or(&ended, Lane::of(0.0)));
                    continue;
                }
            }
            rest = None;
            at += 1;
        }
        ended
    }

    /// When the dead times before and behind the pulse are over. Lanes with another row of edges are not regular.
    #[inline(always)]
    fn edges(&mut self, on: Lane) -> [Lane; 2] {
        let group = self.group;
        let none = Lane::of(0.0);
        let dead = group.dead.or(&mask(|n| on.0[n] > 0.0), none);
        let over = on + dead.or(&group.synchronous, none);
        let same = Lane::of(SAME) * group.t_sw;
        for n in 0..LANES {
            // as the walk asks for its next instant; a dead time that is no interval to it is none here
            let apart = (on.0[n] > dead.0[n] + same.0[n])
                & ((dead.0[n] == 0.0) | (dead.0[n] > same.0[n]))
                & ((over.0[n] == on.0[n]) | (over.0[n] > on.0[n] + same.0[n]))
                & (over.0[n] < group.t_sw.0[n] - same.0[n]);
            self.regular[n] &= u64::from(apart | (on.0[n] == 0.0));
        }
        [dead, over]
    }

    /// `Full::advance_first` of all lanes but those of `ended`, to which those are added whose diode's current ends; the seconds until then.
    #[inline(always)]
    fn advance(&mut self, leg: &Leg, h: Lane, ended: &mut Mask) -> Lane {
        let equation = self.equation(leg);
        let asked = h * self.rate;
        let count = Lane::each(|n| asked.0[n].ceil().max(1.0));
        let most = count.largest();
        let step = if most == 1.0 { h } else { h / count };
        let mut before = self.algebra(leg, &equation);
        let mut used = Lane::of(0.0);
        let mut taken = 0.0;
        while taken < most {
            let takes = mask(|n| (taken < count.0[n]) & (h.0[n] > 0.0) & (ended[n] == 0));
            let start = self.x;
            self.agree(&before, &takes);
            taken += 1.0;
            let mut search = Search::new(step);
            let (next, after) = loop {
                let next = self.runge_kutta(leg, &equation, &before.slopes, search.length, &takes);
                let mut after = before;
                after.i_b = next[I_L];
                if taken < most || self.group.has_core {
                    self.x = next;
                    after = self.algebra(leg, &equation);
                    self.x = start;
                }
                if search.is_over(&takes, [before.i_b * leg.only, after.i_b * leg.only], &leg.only) {
                    break (next, after);
                }
            };
            let crossed = search.crossed;
            // exactly 0, as the walk has it
            let i = Lane::of(0.0).or(&crossed, next[I_L]);
            self.x = [i.or(&takes, start[I_L]), next[V_C].or(&takes, start[V_C])];
            for n in 0..LANES {
                ended[n] |= crossed[n];
                self.regular[n] &= 1 - search.lost[n];
            }
            used = (used + search.length).or(&takes, used);
            before = after;
        }
        Lane::each(|n| used.0[n].min(h.0[n]))
    }

    /// `full::runge_kutta`; `takes` are the lanes that count.
    #[inline(always)]
    fn runge_kutta(&mut self, leg: &Leg, equation: &Equation, k1: &[Lane; 2], h: Lane, takes: &Mask) -> [Lane; 2] {
        let x = self.x;
        let (half, sixth) = (Lane::of(0.5) * h, h / Lane::of(6.0));
        let k2 = self.slopes((leg, equation), x, (k1, half), takes);
        let k3 = self.slopes((leg, equation), x, (&k2, half), takes);
        let k4 = self.slopes((leg, equation), x, (&k3, h), takes);
        self.x = x;
        [0, 1].map(|n| x[n] + sixth * (k1[n] + Lane::of(2.0) * (k2[n] + k3[n]) + k4[n]))
    }

    /// Slopes where slopes have led in some time.
    // a method: what is not inlined is not compiled for wide vectors, and a closure cannot be told to be
    #[inline(always)]
    fn slopes(
        &mut self,
        (leg, equation): (&Leg, &Equation),
        x: [Lane; 2],
        (k, h): (&[Lane; 2], Lane),
        takes: &Mask,
    ) -> [Lane; 2] {
        self.x = [x[0] + h * k[0], x[1] + h * k[1]];
        let algebra = self.algebra(leg, equation);
        self.agree(&algebra, takes);
        algebra.slopes
    }

    #[inline(always)]
    fn equation(&self, leg: &Leg) -> Equation {
        let esr = self.group.esr;
        let slope = leg.slope + esr * self.conductance;
        Equation {
            four: Lane::of(4.0) * slope * esr * self.power,
            fixed: esr * self.current,
            is_plain: slope.0.iter().all(|slope| *slope == 1.0),
            twice: Lane::of(2.0) * slope,
        }
    }

    /// [`Few::algebra`], with the equation of a constant power for every load: its root is the quotient where there is none.
    #[inline(always)]
    fn algebra(&self, leg: &Leg, equation: &Equation) -> Algebra {
        let (group, [i, v_c]) = (self.group, self.x);
        let drive = leg.drive - leg.r * i;
        let right = v_c + group.esr * (leg.give * i) + leg.reflected * drive - equation.fixed;
        let square = right * right - equation.four;
        let sum = right + square.sqrt();
        let v_out = match equation.is_plain {
            true => Lane::of(0.5) * sum,
            false => sum / equation.twice,
        };
        let i_out = self.conductance * v_out + self.current + self.power / v_out;
        let v_l = (drive - leg.give * v_out) * leg.shrunk;
        let i_b = i + group.core * v_l;
        Algebra {
            square,
            v_out,
            i_out,
            i_b,
            slopes: [v_l * group.per_l, (leg.give * i_b - i_out) * group.per_c],
        }
    }

    /// Lanes of `takes` in which the voltage is not the root that was taken are not regular.
    #[inline(always)]
    fn agree(&mut self, algebra: &Algebra, takes: &Mask) {
        for (n, takes) in takes.iter().enumerate() {
            let v = algebra.v_out.0[n];
            // without constant power the quotient may be negative, which is not the root
            let known =
                (algebra.square.0[n] > 0.0) & (v > 0.0) & ((self.power.0[n] == 0.0) | (v >= self.group.v_fold.0[n]));
            self.regular[n] &= u64::from(known | (*takes == 0));
        }
    }
}
