//! The controller type: state, step, checks.

use policy::Scalar;
use proc_macro2::{Ident, Literal as Token, TokenStream};
use quote::quote;

use super::number::{self, number};
use super::statements::Printer;
use super::tokens::{ident, size, word};
use super::{command, guard, integrity, mapping, network, tables};
use crate::lower::known_answers::{LCG, SEED, UNIT, VECTORS};
use crate::program::{Element, Literal, Program, StateMember, StateValue};

/// Type and implementation.
pub fn items(program: &Program, name: &Ident) -> TokenStream {
    let scalar = program.scalar();
    let kind = number::kind(scalar);
    let members = program.state.iter().map(|member| self::member(scalar, member));
    let (declared, initial): (Vec<_>, Vec<_>) = members.unzip();
    let front = front(program);
    let lifecycle = lifecycle(program);
    let sense = sense(program);
    let sound = guard::method(program);
    let decide = command::decide(program);
    let advance = command::advance(program);
    let (eval, step) = bodies(program);
    let set_mapping = mapping::set_mapping(program);
    let checks = checks(program);
    let q_values = network::q_values(program);
    quote! {
        /// One controller: a policy with the memory of its filters. Several instances are independent.
        #[derive(Clone)]
        pub struct #name { #(#declared),* }
        #front
        impl #name {
            /// Start-up state.
            #[must_use]
            pub const fn new() -> Self {
                Self { #(#initial),* }
            }
            #lifecycle
            /// Command for this measurement; changes nothing.
            #[must_use]
            pub fn eval(&self, measured: &Measurement) -> Command {
                #eval
            }
            /// Advances the filters by one sample period, with the command that `eval` gave for this measurement.
            pub fn commit(&mut self, measured: &Measurement, command: &Command) {
                let (front, sound) = self.guarded(measured);
                self.advance(&front, sound, command);
            }
            /// `eval` and `commit`.
            pub fn step(&mut self, measured: &Measurement) -> Command {
                #step
            }
            /// Observation for this measurement; changes nothing.
            #[must_use]
            pub fn observe(&self, measured: &Measurement) -> [#kind; FEATURES] {
                self.sense(measured).observation
            }
            /// Q values of an observation.
            #[must_use]
            pub fn q_values(observation: &[#kind; FEATURES]) -> [#kind; ACTIONS] {
                #q_values
            }
            #set_mapping
            #sense
            #sound
            /// [`Self::sense`], and what a damaged state forbids.
            #[inline(always)]
            fn guarded(&self, measured: &Measurement) -> (Front, u32) {
                // first, so that no number of the measurement waits for it on the stack
                let sound = self.sound();
                let mut front = self.sense(measured);
                front.usable &= sound;
                (front, sound)
            }
            #decide
            #advance
            #checks
        }
        impl Default for #name {
            fn default() -> Self {
                Self::new()
            }
        }
    }
}

/// Bodies of `eval` and `step`.
fn bodies(program: &Program) -> (TokenStream, TokenStream) {
    if program.senses_again {
        return (
            quote! {
                let chosen = self.choose_for(measured);
                let (front, sound) = self.guarded(measured);
                self.decide(&front, sound, chosen)
            },
            quote! {
                let chosen = self.choose_for(measured);
                self.settle(measured, chosen)
            },
        );
    }
    (
        quote! {
            let (front, sound) = self.guarded(measured);
            self.decide(&front, sound, Self::choose(&front.observation))
        },
        quote! {
            let (front, sound) = self.guarded(measured);
            let command = self.decide(&front, sound, Self::choose(&front.observation));
            self.advance(&front, sound, &command);
            command
        },
    )
}

/// A member of the state: its declaration and its value before the first step.
fn member(scalar: Scalar, member: &StateMember) -> (TokenStream, TokenStream) {
    let (kind, name) = (number::kind(scalar), ident(&member.name));
    match &member.value {
        StateValue::Numbers(values) => {
            let length = size(values.len());
            // by bits: -0 is no [0.0; N]
            let initial = if values.iter().all(|value| value.value().to_bits() == 0) {
                quote!([0.0; #length])
            } else {
                let values = values.iter().map(|value| number(scalar, *value));
                quote!([#(#values),*])
            };
            (quote!(#name: [#kind; #length]), quote!(#name: #initial))
        }
        StateValue::Number(value) | StateValue::Coefficient(value) => {
            let value = number(scalar, *value);
            (quote!(#name: #kind), quote!(#name: #value))
        }
        StateValue::Check(bits) => {
            let (kind, bits) = (number::word(scalar), guard::unsuffixed(scalar, *bits));
            (quote!(#name: #kind), quote!(#name: #bits))
        }
        StateValue::Word => (quote!(#name: u32), quote!(#name: 0)),
    }
}

fn lifecycle(program: &Program) -> TokenStream {
    let scalar = program.scalar();
    let kept = |member: &&StateMember| matches!(member.value, StateValue::Coefficient(_) | StateValue::Check(_));
    let kept = program.state.iter().filter(kept);
    let kept: Vec<Ident> = kept.map(|member| ident(&member.name)).collect();
    let fresh = if kept.is_empty() {
        quote!(Self::new())
    } else {
        quote!(Self { #(#kept: self.#kept,)* ..Self::new() })
    };
    let words = program.state.iter().map(|member| {
        let name = ident(&member.name);
        match &member.value {
            StateValue::Numbers(_) => number::all_words(scalar, &quote!(self.#name)),
            StateValue::Number(_) | StateValue::Coefficient(_) => number::words(scalar, &quote!(self.#name)),
            StateValue::Check(_) => match scalar {
                Scalar::F32 => quote!(core::iter::once(self.#name)),
                Scalar::F64 => quote!([self.#name as u32, (self.#name >> 32) as u32]),
            },
            StateValue::Word => quote!(core::iter::once(self.#name)),
        }
    });
    quote! {
        /// Start-up state, but coefficients set at run time stay.
        pub fn reset(&mut self) {
            *self = #fresh;
        }
        /// The state as words, for logging and comparison.
        #[must_use]
        pub fn state_words(&self) -> [u32; STATE_WORDS] {
            let mut words = [0; STATE_WORDS];
            let state = core::iter::empty() #(.chain(#words))*;
            for (word, value) in words.iter_mut().zip(state) {
                *word = value;
            }
            words
        }
    }
}

fn front(program: &Program) -> TokenStream {
    let kind = number::kind(program.scalar());
    let pushes = program.front.pushes.len();
    let push = (pushes > 0).then(|| {
        let pushes = size(pushes);
        quote!(push: [#kind; #pushes],)
    });
    let clipped = program.front.clipped.map(|_| quote!(clipped: u32,));
    let base = program.front.base.map(|_| quote!(base: #kind,));
    let factors = program.front.factors.len();
    let factor = (factors > 0).then(|| {
        let factors = size(factors);
        quote!(factor: [#kind; #factors],)
    });
    let still = program.front.still.map(|_| quote!(still: u32,));
    quote! {
        /// What a measurement means before the network sees it.
        struct Front {
            signal: [#kind; SIGNALS],
            observation: [#kind; FEATURES],
            #push
            bad_count: u32,
            usable: u32,
            held: u32,
            primed_now: u32,
            #clipped
            #base
            #factor
            #still
        }
    }
}

fn sense(program: &Program) -> TokenStream {
    let front = &program.front;
    let printer = Printer::new(program, &front.block);
    let statements = &printer.statements;
    let list = |ids: &[usize]| {
        let values = ids.iter().map(|id| printer.operand(*id));
        quote!([#(#values),*])
    };
    let signal = list(&front.signals);
    let observation = list(&front.observation);
    let pushed: Vec<usize> = front.pushes.iter().map(|push| push.value).collect();
    let push = (!pushed.is_empty()).then(|| {
        let values = list(&pushed);
        quote!(push: #values,)
    });
    let valid = printer.operand(front.all_valid);
    let hold = word(program.hold);
    let clipped = front.clipped.map(|id| {
        let value = printer.operand(id);
        quote!(clipped: #value,)
    });
    let base = front.base.map(|id| {
        let value = printer.operand(id);
        quote!(base: #value,)
    });
    let factor = (!front.factors.is_empty()).then(|| {
        let values = list(&front.factors);
        quote!(factor: #values,)
    });
    let still = front.still.map(|id| {
        let value = printer.operand(id);
        quote!(still: #value,)
    });
    quote! {
        /// Sanitise, filters, observation.
        #[inline(always)]
        fn sense(&self, measured: &Measurement) -> Front {
            #(#statements)*
            // wrapping, like all sums here: checked ones would be ways to a panic in debug builds
            let counted = self.bad_count.wrapping_add(flag(self.bad_count <= #hold));
            let bad_count = counted & #valid.wrapping_sub(1);
            // a flag is 0 or 1: of `primed` the lowest bit counts, as in section 2
            let usable = #valid | (self.primed & flag(bad_count <= #hold));
            Front {
                signal: #signal,
                observation: #observation,
                #push
                bad_count,
                usable,
                held: usable & (#valid ^ 1),
                primed_now: usable & (self.primed ^ 1),
                #clipped
                #base
                #factor
                #still
            }
        }
    }
}

fn checks(program: &Program) -> TokenStream {
    let scalar = program.scalar();
    let kind = number::kind(scalar);
    let checksum = integrity::checksum(Element::Float(scalar));
    let [low, width, answers] = ["box_low", "box_width", "answers"].map(|name| tables::values(program, name));
    let vectors = size(VECTORS);
    let [count, beyond] = [VECTORS, VECTORS + 1].map(|count| Token::u32_suffixed(count as u32));
    let (seed, multiplier, increment, unit) = (
        word(SEED),
        word(LCG.0),
        word(LCG.1),
        number(scalar, Literal::nearest(scalar, UNIT)),
    );
    let zero = match scalar {
        Scalar::F32 => quote!(0.0_f32),
        Scalar::F64 => quote!(0.0_f64),
    };
    quote! {
        /// Known answers: whether the arithmetic of this build is the policy's.
        ///
        /// # Errors
        /// The number (from 1) of the first failing vector.
        pub fn self_test() -> Result<(), u32> {
            static BOX_LOW: [#kind; FEATURES] = #low;
            static BOX_WIDTH: [#kind; FEATURES] = #width;
            static ANSWERS: [u32; #vectors] = #answers;
            let mut random: u32 = #seed;
            // number of the first vector without a right answer, and right answers before it: a fault in either shows in a sound
            // build, too, for no count but the full one gives 0
            let mut next = 1_u32;
            let mut right = 0_u32;
            let mut vector = 0_u32;
            for answer in &ANSWERS {
                let mut observation = [#zero; FEATURES];
                for ((value, low), width) in observation.iter_mut().zip(&BOX_LOW).zip(&BOX_WIDTH) {
                    random = random.wrapping_mul(#multiplier).wrapping_add(#increment);
                    *value = *low + *width * ((random >> 8) as #kind * #unit);
                }
                let crc = !#checksum(u32::MAX, &Self::q_values(&observation));
                vector = vector.wrapping_add(1);
                if next == vector && crc == *answer {
                    next = vector.wrapping_add(1);
                    right = right.wrapping_add(1);
                }
            }
            let failing = if right == #count { #beyond.wrapping_sub(next) } else { right.wrapping_add(1) };
            if failing == 0 { Ok(()) } else { Err(failing) }
        }
        /// CRC-32 over the tables: whether they are as generated.
        #[must_use]
        pub fn integrity() -> bool {
            IntegrityCheck::new().slice(IntegrityCheck::LENGTH) == Some(true)
        }
    }
}
