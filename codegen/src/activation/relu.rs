//! x if x > 0, else +0, without a branch in the binary.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::text::{C, Rust, Text, c_shifted, rust_shifted};
use crate::backend::rust::number;
use crate::program::{Cut, Store};

pub(super) struct Relu;

impl Text for Relu {
    fn c_helper(&self, c: &C<'_>) -> Vec<String> {
        let C {
            n,
            number,
            word,
            suffix,
            top,
            ..
        } = c;
        let why = match c.has_fpu {
            true => ": both operations are exact, no value comes near the end of the format",
            false => "",
        };
        let head = format!(
            "
/* x if x > 0 else +0, no branch in the binary{why} */
static {number} {n}_relu({number} x)
{{"
        );
        let masked = format!(
            "    const {word} bits = {n}_bits(x);
    return {n}_from_bits(bits & ~(({word})0 - (bits >> {top})));"
        );
        // what a mask leaves, intervals do not see; a NaN passes, as it does below
        let branches = format!("    return (x <= 0.0{suffix}) ? 0.0{suffix} : x;");
        // where floats are computed in hardware a sum and a product are faster than the way through integer registers
        let body = match c.has_fpu {
            true => format!(
                "#if defined(__FRAMAC__)
{branches}
#elif defined(__GNUC__)
    return (x + __builtin_fabs{suffix}(x)) * 0.5{suffix};
#else
{masked}
#endif"
            ),
            false => format!(
                "#if defined(__FRAMAC__)
{branches}
#else
{masked}
#endif"
            ),
        };
        vec![head, body, "}".to_owned()]
    }

    fn c(&self, c: &C<'_>, sum: &str) -> String {
        format!("{}_relu({sum})", c.n)
    }

    fn c_integer_helper(&self, c: &C<'_>) -> Vec<String> {
        // `__usat` clears what is below 0; above 32767 it has nothing to cut, as the scales prove
        let C { n, u, .. } = c;
        vec![format!(
            "
/* x if x > 0 else 0; never above 32767 */
static int32_t {n}_positive(int32_t x)
{{
#if defined(__FRAMAC__)
    return (x > 0) ? x : 0;
#elif defined({u}_DSP)
    return (int32_t)__usat(x, 15);
#else
    return x & ~{n}_below_zero((uint32_t)x);
#endif
}}"
        )]
    }

    fn c_integer(&self, c: &C<'_>, sum: &str, cut: &Cut) -> String {
        format!("{}_positive({})", c.n, c_shifted(sum, cut))
    }

    fn rust_helper(&self, rust: &Rust) -> TokenStream {
        let kind = number::kind(rust.scalar);
        let number::Bits {
            magnitude, positive, ..
        } = number::bits(rust.scalar);
        let rectified = if rust.has_fpu {
            // both operations are exact: no value comes near the end of the format
            quote!((x + #magnitude) * 0.5)
        } else {
            positive
        };
        quote! {
            /// x if x > 0 else +0, no branch in the binary
            #[inline(always)]
            #[allow(dead_code)]
            fn relu(x: #kind) -> #kind {
                #rectified
            }
        }
    }

    fn rust(&self, _scalar: Scalar) -> TokenStream {
        quote!(relu(sum))
    }

    fn rust_integer_helper(&self) -> TokenStream {
        quote! {
            #[inline(always)]
            #[allow(dead_code)]
            fn positive(x: i32) -> i16 {
                (x & !(x >> 31)) as i16
            }
        }
    }

    fn rust_integer(&self, _store: &Store, cut: &Cut) -> TokenStream {
        let shifted = rust_shifted(cut);
        quote!(positive(#shifted))
    }

    fn single(&self, x: f32) -> f32 {
        if x > 0.0 { x } else { 0.0 }
    }

    fn double(&self, x: f64) -> f64 {
        if x > 0.0 { x } else { 0.0 }
    }

    fn integer(&self, sum: i32, cut: &Cut) -> i32 {
        (sum >> cut.shift).max(0)
    }
}
