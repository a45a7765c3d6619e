// three duties from one network: arrays with a place for each name, as `policyc compile --emit rust` writes them
policy_macro::include_policy!("legs/policy.toml");

#[allow(dead_code)]
mod text {
    include!(concat!(env!("CARGO_MANIFEST_DIR"), "/text/constructs.rs"));
}

use constructs::{OUTPUTS, OUTPUT_LEFT, OUTPUT_MID, OUTPUT_RIGHT};

const _: () = assert!(OUTPUTS == 3 && OUTPUT_LEFT == 0 && OUTPUT_RIGHT == 1 && OUTPUT_MID == 2);

fn main() {
    let (mut a, mut b) = (constructs::Controller::new(), text::Controller::new());
    for step in 0..2000_u32 {
        let v_out = if step % 97 == 0 { f32::NAN } else { (step.wrapping_mul(2654435761) >> 8) as f32 * 4e-6 };
        let (i_l, i_out) = ((step.wrapping_mul(40503) % 4096) as i32, (step % 16) as f32);
        let x = a.step(&constructs::Measurement { v_out, i_l, i_out });
        let y = b.step(&text::Measurement { v_out, i_l, i_out });
        assert_eq!((x.duty.map(f32::to_bits), x.duty_sim), (y.duty.map(f32::to_bits), y.duty_sim));
        assert_eq!((x.action_index, x.status), (y.action_index, y.status));
        if step % 500 == 250 {
            assert!(a.set_mapping_right(0.97, 0.001, 0.0) && b.set_mapping_right(0.97, 0.001, 0.0));
        }
        assert_eq!(a.state_words(), b.state_words());
    }
}
