//! Comparisons of the state with its ranges, by bits.

use policy::Scalar;
use proc_macro2::{Literal as Token, TokenStream};
use quote::quote;

use super::statements::remembered;
use super::tokens::size;
use super::{mapping, number};
use crate::program::{Guarded, Place, Program, Within};

/// The functions that compare, and the method that says whether the state is sound.
pub fn method(program: &Program) -> TokenStream {
    let terms = program.guard.numbers.iter().map(|guarded| term(program, guarded));
    let most = Token::u32_suffixed(program.guard.bad_count);
    let top = match program.scalar() {
        Scalar::F32 => quote!(stray),
        Scalar::F64 => quote!((stray >> 32) as u32),
    };
    let (flips, called): (Vec<_>, Vec<_>) = mapping::flips(program).into_iter().unzip();
    // the bits of `primed` above the lowest beside the flipped ones, where there are some: with a difference of their own they
    // take three instructions more
    let above = match program.scalar() {
        Scalar::F32 => quote!((self.primed >> 1)),
        Scalar::F64 => quote!(u64::from(self.primed >> 1)),
    };
    let (coefficients, primed) = match called.is_empty() {
        false => (Some(quote!(| any(#(self.#called() |)* #above))), None),
        true => (None, Some(quote!(| 1_u32.wrapping_sub(self.primed) | self.primed))),
    };
    // each counter beside its difference: from 2^31 on the difference alone would look small again. The answer of `sound` stands
    // behind a barrier: of what is known to be 0 or 1 the optimiser makes a branch
    //
    // `damage` is a function of its own, so that its words have all registers: within a step they push the numbers of the
    // measurement onto the stack, which takes about 50 instructions more on a Cortex-M4F
    quote! {
        #(#flips)*
        /// The sign bit is set if the state is not one that the controller can have written: a bit flipped that would decide the duty.
        #[inline(never)]
        fn damage(&self) -> u32 {
            let stray = #(#terms)|* #coefficients;
            #top | #most.wrapping_sub(self.bad_count) | self.bad_count #primed
        }
        /// 1 if the state is one that the controller can have written, else 0.
        #[inline(always)]
        fn sound(&self) -> u32 {
            core::hint::black_box((self.damage() >> 31) ^ 1)
        }
    }
}

/// Bits as a literal.
pub fn unsuffixed(scalar: Scalar, bits: u64) -> Token {
    match scalar {
        Scalar::F32 => Token::u32_unsuffixed(bits as u32),
        Scalar::F64 => Token::u64_unsuffixed(bits),
    }
}

/// A word whose sign bit is set if `x` is outside.
pub fn stray(scalar: Scalar, x: &TokenStream, within: Within) -> TokenStream {
    let bits = |bits| unsuffixed(scalar, bits);
    match within {
        Within::Magnitude { bound } => {
            let bound = bits(bound);
            quote!(far(#x, #bound))
        }
        Within::Around { low, high } => {
            let (low, high) = (bits(low), bits(high));
            quote!(aside(#x, #low, #high))
        }
        Within::Beyond { low, width, negated } => {
            let (low, width) = (bits(low), bits(width));
            let sign = negated.then(|| quote!(-));
            quote!(beyond(#sign #x, #low, #width))
        }
    }
}

fn term(program: &Program, guarded: &Guarded) -> TokenStream {
    let scalar = program.scalar();
    let place = match guarded.place {
        Place::Held(index) => {
            let index = size(index);
            quote!(self.held[#index])
        }
        // one word needs no loop
        Place::Memory { first, count: 1 } => {
            let first = size(first);
            quote!(self.memory[#first])
        }
        Place::Memory { first, count } => {
            let (first, count) = (size(first), size(count));
            let one = stray(scalar, &quote!(*word), guarded.within);
            return quote!(self.memory.iter().skip(#first).take(#count).fold(0, |stray, word| stray | #one));
        }
        Place::PreviousDuty(output) => remembered(program, "previous_duty", output),
        Place::PreviousCommand(output) => remembered(program, "previous_command", output),
        Place::SoftCap(output) => remembered(program, "soft_cap", output),
    };
    stray(scalar, &place, guarded.within)
}

/// The comparisons: integers, because a comparison of floats costs more and a NaN must be outside.
pub fn helpers(scalar: Scalar) -> TokenStream {
    let kind = number::kind(scalar);
    let bits = number::word(scalar);
    // of `aside`: each difference counts for the numbers of its sign. A bound chosen by a mask needs a barrier, since optimisers
    // make a branch of a mask that is made of a sign
    let magnitude = match scalar {
        Scalar::F32 => quote!(0x7FFF_FFFF),
        Scalar::F64 => quote!(0x7FFF_FFFF_FFFF_FFFF),
    };
    quote! {
        /// The sign bit is set if |x| is above the number with the bits `bound`.
        #[inline(always)]
        #[allow(dead_code)]
        fn far(x: #kind, bound: #bits) -> #bits {
            bound.wrapping_sub(x.to_bits() & #magnitude)
        }
        /// The sign bit is set if x is below the number with the bits `low`, whose sign is set, or above the one with `high`.
        #[inline(always)]
        #[allow(dead_code)]
        fn aside(x: #kind, low: #bits, high: #bits) -> #bits {
            let bits = x.to_bits();
            (low.wrapping_sub(bits) & bits) | (high.wrapping_sub(bits) & !bits)
        }
        /// The sign bit is set if x is not among the `width` numbers from that with the bits `low` on.
        #[inline(always)]
        #[allow(dead_code)]
        fn beyond(x: #kind, low: #bits, width: #bits) -> #bits {
            let above = x.to_bits().wrapping_sub(low);
            above | width.wrapping_sub(above)
        }
        /// The sign bit is set if any bit is.
        #[inline(always)]
        #[allow(dead_code)]
        fn any(bits: #bits) -> #bits {
            bits | (0 as #bits).wrapping_sub(bits)
        }
    }
}
