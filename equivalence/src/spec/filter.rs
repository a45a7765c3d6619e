//! Section 4: the filters.

use policy::Filter;

use super::Spec;
use crate::term::Term;

/// What a filter gives in one step, and its line behind the push.
pub(crate) struct Filtered {
    pub y: Term,
    pub words: Vec<Term>,
}

/// One filter with the words of its memory; `primed` is the lowest bit of the state's word.
pub(crate) fn filter(spec: Spec<'_>, filter: &Filter, line: &[Term], primed: Term, x: Term) -> Filtered {
    let (terms, float) = (spec.terms, spec.float);
    let period = spec.policy.sample_period;
    let read = |word: Term, unprimed: Term| terms.choose(primed, word, unprimed);
    let push = |line: &[Term], pushed: Term| -> Vec<Term> {
        let next = line.iter().skip(1).copied().chain([pushed]);
        next.map(|word| read(word, pushed)).collect()
    };
    match (*filter, line) {
        (Filter::Delay { .. }, [oldest, ..]) => Filtered {
            y: read(*oldest, x),
            words: push(line, x),
        },
        (Filter::BackwardDifference, [x1]) => {
            let k = spec.nearest(1.0 / period);
            Filtered {
                y: float.mul(float.sub(x, read(*x1, x)), k),
                words: push(line, x),
            }
        }
        (Filter::LowPass { time_constant }, [y1]) => {
            let k = spec.nearest(period / (time_constant + period));
            let y1 = read(*y1, x);
            let y = float.add(y1, float.mul(k, float.sub(x, y1)));
            Filtered {
                y,
                words: push(line, y),
            }
        }
        (Filter::FilteredDerivative { time_constant }, [x1, y1]) => {
            let p = spec.nearest(time_constant / (time_constant + period));
            let k = spec.nearest(1.0 / (time_constant + period));
            let difference = float.sub(x, read(*x1, x));
            let y = float.add(float.mul(p, read(*y1, spec.zero())), float.mul(k, difference));
            Filtered { y, words: vec![x, y] }
        }
        (Filter::MovingAverage { samples }, line) => {
            // oldest first, x last
            let sum = line
                .iter()
                .map(|word| read(*word, x))
                .reduce(|s, next| float.add(s, next));
            let sum = sum.map_or(x, |s| float.add(s, x));
            Filtered {
                y: float.mul(sum, spec.nearest(1.0 / samples as f64)),
                words: push(line, x),
            }
        }
        (
            Filter::Integrator {
                min,
                max,
                initial,
                leak,
            },
            [y1],
        ) => {
            let y1 = read(*y1, spec.nearest(initial));
            let kept = match leak == 1.0 {
                true => y1,
                false => float.mul(spec.nearest(leak), y1),
            };
            let sum = float.add(kept, float.mul(spec.nearest(period), x));
            let y = float.clamp(sum, spec.nearest(min), spec.nearest(max));
            Filtered {
                y,
                words: push(line, y),
            }
        }
        // `State::any` has made the lines of these lengths
        (_, line) => Filtered {
            y: x,
            words: line.to_vec(),
        },
    }
}
