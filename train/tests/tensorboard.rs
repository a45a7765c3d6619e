//! Event files against what TensorBoard's own writer makes of the same events.

use train::tensorboard::{opening, scalars};

/// Three records, by
/// ```text
/// w = tensorboard.summary.writer.record_writer.RecordWriter(file)             # tensorboard 2.21.0, protobuf 7.36.2
/// w.write(Event(wall_time=1.5, file_version="brain.Event:2").SerializeToString())
/// w.write(Event(wall_time=2.5, step=300, summary=Summary(value=[Summary.Value(tag="train/reward", simple_value=-0.25),
///     Summary.Value(tag="selection/cost", simple_value=1.5)])).SerializeToString())
/// w.write(Event(wall_time=3.5, step=120000, summary=Summary(value=[
///     Summary.Value(tag="selection/best_cost", simple_value=float("inf"))])).SerializeToString())
/// ```
const THEIRS: &str = "\
    1800000000000000a37f4b2209000000000000f83f1a0d627261696e2e4576656e743a322a28646c\
    3a000000000000001295eae209000000000000044010ac022a2c0a130a0c747261696e2f72657761\
    726415000080be0a150a0e73656c656374696f6e2f636f7374150000c03ff35516362b0000000000\
    0000861bc34b090000000000000c4010c0a9072a1c0a1a0a1373656c656374696f6e2f626573745f\
    636f7374150000807fcaf89d14";

#[test]
fn records_have_the_bytes_of_tensorboards_own_writer() {
    let mut ours = opening(1.5);
    ours.extend(scalars(2.5, 300, &[("train/reward", -0.25), ("selection/cost", 1.5)]));
    ours.extend(scalars(3.5, 120_000, &[("selection/best_cost", f64::INFINITY)]));
    let ours: String = ours.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(ours, THEIRS);
}
