//! From the network to a command, and what of it is remembered: mapping, limits, status, and the state of the next step.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::network;
use super::number::{self, number};
use super::statements::{Printer, remembered};
use super::tokens::{size, word};
use crate::lower::command as lowered;
use crate::program::{Duty, Program};

/// The functions that choose and decide.
pub fn decide(program: &Program) -> TokenStream {
    let decide = &program.decide;
    let printer = Printer::new(program, &decide.block);
    let statements = &printer.statements;
    let terms = decide.status.iter().map(|(bit, flag)| {
        let (flag, bit) = (printer.operand(*flag), word(*bit));
        quote!((#flag << #bit))
    });
    // shifted and not masked, which is an instruction less on Arm
    let fallback_bit = word(lowered::bit("FALLBACK"));
    // behind its limits, which lie within 0 and 1, a duty has the second highest bit only if it is no number
    let scalar = program.scalar();
    let stray = |duty: TokenStream| match scalar {
        Scalar::F32 => quote!((#duty.to_bits() >> 30)),
        Scalar::F64 => quote!((#duty.to_bits() >> 62) as u32),
    };
    let operands = decide.duties.iter().map(|duty| printer.operand(duty.duty));
    let strays: Vec<TokenStream> = operands.map(stray).collect();
    let stray = match strays.as_slice() {
        [one] => one.clone(),
        all => quote!((#(#all)|*)),
    };
    let network::Choice {
        about,
        about_apart,
        kind,
        name,
        body,
        chosen,
        indices,
    } = network::choice(program);
    let number_kind = number::kind(program.scalar());
    let selected = |pick: fn(&Duty) -> usize| {
        let both = decide.duties.iter().zip(&program.outputs);
        let each = both.map(|(duty, output)| {
            let (value, fallback) = (printer.operand(pick(duty)), number(scalar, output.fallback));
            quote!(select(usable, #value, #fallback))
        });
        listed(each.collect())
    };
    let (duty, duty_sim) = (selected(|duty| duty.duty), selected(|duty| duty.duty_sim));
    let index = listed(indices);
    let apart = program.senses_again.then(|| {
        quote! {
            #[doc = #about_apart]
            // apart, so that its numbers are off the stack while the network runs
            #[inline(never)]
            fn choose_for(&self, measured: &Measurement) -> #kind {
                Self::choose(&self.sense(measured).observation)
            }
            /// What a step does behind the network.
            #[inline(never)]
            fn settle(&mut self, measured: &Measurement, chosen: #kind) -> Command {
                let (front, sound) = self.guarded(measured);
                let command = self.decide(&front, sound, chosen);
                self.advance(&front, sound, &command);
                command
            }
        }
    });
    quote! {
        #apart
        #[doc = #about]
        #[inline(always)]
        fn choose(observation: &[#number_kind; FEATURES]) -> #kind {
            #body
        }
        /// Mapping, limits, status.
        #[inline(always)]
        fn decide(&self, front: &Front, sound: u32, #name: #kind) -> Command {
            #(#chosen)*
            #(#statements)*
            let trusted = sound & !#stray;
            let usable = front.usable & trusted;
            let status = #(#terms)|*;
            Command {
                duty: #duty,
                duty_sim: #duty_sim,
                action_index: #index,
                status: (status & 0_u32.wrapping_sub(usable))
                    | ((usable ^ 1) << #fallback_bit)
                    | (status::STATE & trusted.wrapping_sub(1)),
            }
        }
    }
}

/// One value, or several as an array.
fn listed(values: Vec<TokenStream>) -> TokenStream {
    match values.as_slice() {
        [one] => one.clone(),
        all => quote!([#(#all),*]),
    }
}

/// The function that moves the state on.
pub fn advance(program: &Program) -> TokenStream {
    let printer = Printer::new(program, &program.advance.block);
    let statements = &printer.statements;
    let caps = program.advance.soft_caps.iter().enumerate();
    let soft_caps = caps.filter_map(|(output, id)| {
        let (place, value) = (remembered(program, "soft_cap", output), printer.operand((*id)?));
        Some(quote! { #place = #value; })
    });
    let duties = (0..program.outputs.len()).map(|output| {
        let [duty, command] = ["previous_duty", "previous_command"].map(|stem| remembered(program, stem, output));
        let at = size(output);
        let place = program.has_several().then(|| quote!([#at]));
        quote! {
            #duty = command.duty_sim #place;
            #command = command.duty #place;
        }
    });
    let pushes = program.front.pushes.iter().enumerate().map(|(index, push)| {
        let (first, last, length) = (size(push.word), size(push.word + push.length - 1), size(push.length));
        let index = size(index);
        if push.length == 1 {
            return quote! { self.memory[#last] = select(sound, front.push[#index], 0.0); };
        }
        quote! {
            let pushed = select(sound, front.push[#index], 0.0);
            let mut moved = pushed;
            for word in self.memory.iter_mut().skip(#first).take(#length).rev() {
                let before = select(self.primed & sound, *word, pushed);
                *word = moved;
                moved = before;
            }
        }
    });
    quote! {
        /// Filters, held samples and counters move on by one sample period.
        #[inline(always)]
        fn advance(&mut self, front: &Front, sound: u32, command: &Command) {
            #(#statements)*
            #(#pushes)*
            #(#soft_caps)*
            self.held = front.signal;
            #(#duties)*
            self.bad_count = front.bad_count & 0_u32.wrapping_sub(sound);
            // 0 or 1; of a damaged state, which is never usable, 2
            self.primed = front.usable.wrapping_add(2).wrapping_sub(sound << 1);
        }
    }
}
