//! x / (1 + |x|): a sum and a quotient, each rounded once. The divisor is at least 1, so nothing can overflow.

use proc_macro2::TokenStream;
use quote::quote;

use super::curve::Function;
use super::number::Number;
use super::text::{C, Needs, Rust};
use crate::backend::rust::number;

pub(super) struct Softsign;

impl Function for Softsign {
    fn name(&self) -> &'static str {
        "softsign"
    }

    fn needs(&self) -> Needs {
        Needs::default()
    }

    fn c(&self, c: &C<'_>) -> Vec<String> {
        let (
            C {
                n, number, magnitude, ..
            },
            one,
        ) = (c, (c.literal)(c.scalar, 1.0));
        // the magnitude by its bits: `fabs` would be a call of libm without optimisation
        vec![format!(
            "
/* x / (1 + |x|) */
static {number} {n}_softsign({number} x)
{{
#if defined(__FRAMAC__)
    const {number} y = x / ({one} + {n}_magnitude(x));
    /* intervals do not see that both numbers are one; an infinity gives a NaN */
    /*@ admit \\is_NaN(y) || (-1.0 <= y <= 1.0); */
    return y;
#else
    return x / ({one} + {n}_from_bits({n}_bits(x) & {magnitude}));
#endif
}}"
        )]
    }

    fn rust(&self, rust: &Rust) -> TokenStream {
        let kind = number::kind(rust.scalar);
        let magnitude = number::bits(rust.scalar).magnitude;
        quote! {
            /// x / (1 + |x|)
            #[inline(always)]
            fn softsign(x: #kind) -> #kind {
                x / (1.0 + #magnitude)
            }
        }
    }

    fn value<T: Number>(&self, x: T) -> T {
        x / (T::nearest(1.0) + T::nearest(x.wide().abs()))
    }
}
