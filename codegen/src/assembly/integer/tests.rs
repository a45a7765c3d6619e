//! The text is run by a small model of the processor and compared with plain sums of products.

use std::collections::BTreeMap;

use super::*;

const INPUTS: u32 = 0x1000;
const OUTPUTS: u32 = 0x3000;
const WEIGHTS: u32 = 0x5000;
const BIASES: u32 = 0x9000;
/// Weights of the last layer.
const LAST: u32 = 0xB000;
const STACK: u32 = 0xF000;

/// Registers by name and bytes by address; what nobody has written must not be read.
#[derive(Default)]
struct Model {
    registers: BTreeMap<String, u32>,
    bytes: BTreeMap<u32, u8>,
    is_zero: bool,
}

/// `r4-r6, lr` as the registers that it names.
fn named(list: &str) -> Vec<String> {
    let one = |part: &str| match part.split_once('-') {
        Some((first, last)) => {
            let number = |name: &str| name[1..].parse::<u32>().unwrap_or_else(|_| panic!("{list}"));
            (number(first)..=number(last)).map(|n| format!("r{n}")).collect()
        }
        None => vec![part.to_owned()],
    };
    list.split(", ").flat_map(one).collect()
}

fn halves(word: u32) -> [i64; 2] {
    [i64::from(word as u16 as i16), i64::from((word >> 16) as u16 as i16)]
}

impl Model {
    fn get(&self, name: &str) -> u32 {
        *self.registers.get(name).unwrap_or_else(|| panic!("{name} was not set"))
    }

    fn set(&mut self, name: &str, value: u32) {
        self.registers.insert(name.to_owned(), value);
    }

    fn load(&self, address: u32) -> u32 {
        assert!(address.is_multiple_of(4), "{address:#x}");
        let byte = |at| {
            *self
                .bytes
                .get(&at)
                .unwrap_or_else(|| panic!("{at:#x} is not to be read"))
        };
        u32::from_le_bytes([0, 1, 2, 3].map(|n| byte(address + n)))
    }

    fn store(&mut self, address: u32, bytes: &[u8]) {
        assert!(address.is_multiple_of(bytes.len() as u32), "{address:#x}");
        for (at, byte) in (address..).zip(bytes) {
            self.bytes.insert(at, *byte);
        }
    }

    fn place(&mut self, from: u32, words: &[u32]) {
        for (at, word) in (from..).step_by(4).zip(words) {
            self.store(at, &word.to_le_bytes());
        }
    }

    /// The address of `[r1]`, `[r1], #8` or `[sp, #4]`; the first moves the register on.
    fn address(&mut self, operand: &str) -> u32 {
        let (inner, behind) = operand[1..].split_once(']').unwrap();
        let number = |text: &str| text.trim_start_matches(", #").parse::<u32>().unwrap();
        let (base, offset) = inner.split_once(", #").unwrap_or((inner, "0"));
        let address = self.get(base) + number(offset);
        if !behind.is_empty() {
            self.set(base, address + number(behind));
        }
        address
    }

    /// `r8` or `#8`.
    fn value(&self, operand: &str) -> u32 {
        match operand.strip_prefix('#') {
            Some(number) => number.parse().unwrap(),
            None => self.get(operand),
        }
    }

    /// Many registers from `pointer!, r4, r5` on, or into them.
    fn several(&mut self, operands: &str, is_load: bool) {
        let (pointer, list) = operands.split_once("!, ").unwrap();
        let mut at = self.get(pointer);
        let names = named(list);
        assert!(
            names
                .windows(2)
                .all(|pair| pair[0].len() < pair[1].len() || pair[0] < pair[1]),
            "{list}"
        );
        for name in names {
            match is_load {
                true => self.set(&name, self.load(at)),
                false => self.store(at, &self.get(&name).to_le_bytes()),
            }
            at += 4;
        }
        self.set(pointer, at);
    }

    /// One or two registers at an address.
    fn moved(&mut self, operands: &str, count: usize, is_load: bool) {
        let at = operands.find('[').unwrap();
        let names = named(operands[..at].trim_end_matches(", "));
        assert_eq!(names.len(), count, "{operands}");
        let address = self.address(&operands[at..]);
        for (name, at) in names.iter().zip((address..).step_by(4)) {
            match is_load {
                true => self.set(name, self.load(at)),
                false => self.store(at, &self.get(name).to_le_bytes()),
            }
        }
    }

    fn push(&mut self, list: &str) {
        for name in named(list).iter().rev() {
            let top = self.get("sp") - 4;
            self.set("sp", top);
            self.store(top, &self.get(name).to_le_bytes());
        }
    }

    fn pop(&mut self, list: &str) {
        for name in named(list) {
            let top = self.get("sp");
            self.set(&name, self.load(top));
            self.set("sp", top + 4);
        }
    }

    /// Three operands, of which the first is set.
    fn arithmetic(&mut self, name: &str, operands: &str) {
        let parts: Vec<&str> = operands.splitn(4, ", ").collect();
        let first = self.value(parts[1]);
        let shifted = |text: &str| {
            text.rsplit_once('#')
                .map_or(0, |(_, bits)| bits.parse::<u32>().unwrap())
        };
        let value = match name {
            "add" => first.wrapping_add(self.value(parts[2])),
            "subw" | "subs" => first.wrapping_sub(self.value(parts[2])),
            "asr" => (first.cast_signed() >> self.value(parts[2])).cast_unsigned(),
            "smlad" => {
                let (w, x) = (halves(first), halves(self.get(parts[2])));
                let sum = i64::from(self.get(parts[3]).cast_signed()) + w[0] * x[0] + w[1] * x[1];
                i32::try_from(sum).unwrap().cast_unsigned()
            }
            "sxtb16" => {
                let turned = first.rotate_right(parts.get(2).map_or(0, |turn| shifted(turn)));
                let [low, high] = [turned as u8 as i8, (turned >> 16) as u8 as i8].map(|byte| byte as i16 as u16);
                u32::from(low) | (u32::from(high) << 16)
            }
            "usat" => {
                assert_eq!(parts[1], "#15");
                let x = self.get(parts[2]).cast_signed() >> parts.get(3).map_or(0, |shift| shifted(shift));
                x.clamp(0, 32_767).cast_unsigned()
            }
            "pkhbt" => (first & 0xFFFF) | (self.get(parts[2]) << shifted(parts[3])),
            _ => panic!("{name} {operands}"),
        };
        self.is_zero = value == 0;
        self.set(parts[0], value);
    }

    fn run(&mut self, lines: &[String]) {
        let mut at = 0;
        for _ in 0..200_000 {
            let Some(line) = lines.get(at) else { return };
            at += 1;
            if line.ends_with(':') {
                continue;
            }
            let (name, operands) = line.split_once(' ').unwrap();
            match name {
                "push" => self.push(operands),
                "pop" => self.pop(operands),
                "mov" | "movw" => {
                    let (to, from) = operands.split_once(", ").unwrap();
                    self.set(to, self.value(from));
                }
                "ldmia" | "stmia" => self.several(operands, name == "ldmia"),
                "ldr" | "str" => self.moved(operands, 1, name == "ldr"),
                "ldrd" | "strd" => self.moved(operands, 2, name == "ldrd"),
                "strh" => {
                    let (from, to) = operands.split_once(", ").unwrap();
                    let address = self.address(to);
                    self.store(address, &(self.get(from) as u16).to_le_bytes());
                }
                "cmp" => {
                    let (one, other) = operands.split_once(", ").unwrap();
                    self.is_zero = self.get(one) == self.get(other);
                }
                "bne" if self.is_zero => {}
                "bne" => {
                    let label = operands.replace('b', ":");
                    at = lines[..at].iter().rposition(|line| *line == label).unwrap();
                }
                _ => self.arithmetic(name, operands),
            }
        }
        panic!("it does not end");
    }
}

/// Small numbers of both signs, the same in every run.
struct Numbers(u32);

impl Numbers {
    fn within(&mut self, most: i32) -> i32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8).cast_signed() % (2 * most + 1) - most
    }

    fn some(&mut self, count: usize, most: i32) -> Vec<i32> {
        (0..count).map(|_| self.within(most)).collect()
    }
}

fn word(halves: [i32; 2]) -> u32 {
    u32::from(halves[0] as u16) | (u32::from(halves[1] as u16) << 16)
}

fn bytes(bytes: [i32; 4]) -> u32 {
    u32::from_le_bytes(bytes.map(|byte| byte as i8 as u8))
}

/// Weights of one sum and its inputs as words: two halves a word, or four bytes of which the even ones meet the first two inputs.
fn packed(weights: &[i32], is_quad: bool) -> Vec<u32> {
    let at = |chunk: &[i32], n: usize| chunk.get(n).copied().unwrap_or(0);
    match is_quad {
        true => weights
            .chunks(4)
            .map(|w| bytes([at(w, 0), at(w, 2), at(w, 1), at(w, 3)]))
            .collect(),
        false => weights.chunks(2).map(|w| word([at(w, 0), at(w, 1)])).collect(),
    }
}

/// Places random numbers, runs the kernel, and compares everything that it leaves.
fn assert_computes(kernel: &Kernel) {
    let Kernel {
        is_quad,
        groups,
        count,
        height,
        shift,
        store,
        sums,
    } = *kernel;
    let mut numbers = Numbers(17);
    let inputs = numbers.some(groups * if is_quad { 4 } else { 2 }, 20);
    let biases = numbers.some(count * height, if store == Store::Rectified { 1 << 20 } else { 5000 });
    let last = sums.unwrap_or(0);
    let mut totals = numbers.some(last, 1000);
    let mut model = Model::default();
    model.place(
        INPUTS,
        &inputs.chunks(2).map(|x| word([x[0], x[1]])).collect::<Vec<_>>(),
    );
    model.place(
        OUTPUTS,
        &totals.iter().map(|sum| sum.cast_unsigned()).collect::<Vec<_>>(),
    );
    model.place(
        BIASES,
        &biases.iter().map(|bias| bias.cast_unsigned()).collect::<Vec<_>>(),
    );
    let (mut weights, mut to_last, mut outputs) = (Vec::new(), Vec::new(), Vec::new());
    for block in biases.chunks(height) {
        let rows: Vec<Vec<i32>> = block.iter().map(|_| numbers.some(inputs.len(), 20)).collect();
        let words: Vec<Vec<u32>> = rows.iter().map(|row| packed(row, is_quad)).collect();
        weights.extend((0..groups).flat_map(|group| words.iter().map(move |row| row[group])));
        let sum = |(row, bias): (&Vec<i32>, &i32)| bias + row.iter().zip(&inputs).map(|(w, x)| w * x).sum::<i32>();
        let cut = |sum: i32| match store {
            Store::Rectified => (sum >> shift).clamp(0, 32_767),
            Store::Half | Store::Word => sum >> shift,
        };
        let y: Vec<i32> = rows.iter().zip(block).map(sum).map(cut).collect();
        for total in &mut totals {
            let own = numbers.some(height, 20);
            to_last.extend(packed(&own, is_quad));
            *total += own.iter().zip(&y).map(|(w, y)| w * y).sum::<i32>();
        }
        outputs.extend(y);
    }
    model.place(WEIGHTS, &weights);
    model.place(LAST, &to_last);
    model.place(STACK, &[LAST]);
    for (register, value) in ["r0", "r1", "r2", "r3", "sp", "lr"]
        .iter()
        .zip([INPUTS, OUTPUTS, WEIGHTS, BIASES, STACK, 0xAA])
    {
        model.set(register, value);
    }
    (4..12).for_each(|n| model.set(&format!("r{n}"), 0xC0DE_0000 + n));
    model.run(&kernel.text(&str::to_owned));
    let expected: Vec<u8> = match (sums, store) {
        (Some(_), _) => totals.iter().flat_map(|sum| sum.to_le_bytes()).collect(),
        (None, Store::Word) => outputs.iter().flat_map(|y| y.to_le_bytes()).collect(),
        (None, _) => outputs.iter().flat_map(|y| (*y as i16).to_le_bytes()).collect(),
    };
    let found: Vec<u8> = model.bytes.range(OUTPUTS..WEIGHTS).map(|(_, byte)| *byte).collect();
    let what =
        format!("quad {is_quad}, {groups} groups, {count} blocks of {height}, {store:?} >> {shift}, sums {sums:?}");
    assert_eq!(found, expected, "{what}");
    assert!(
        (4..12).all(|n| model.get(&format!("r{n}")) == 0xC0DE_0000 + n),
        "{what}: a register is lost"
    );
    assert_eq!((model.get("sp"), model.get("pc")), (STACK, 0xAA), "{what}");
}

fn kernel(is_quad: bool, groups: usize, (count, height): (usize, usize), store: Store, sums: Option<usize>) -> Kernel {
    Kernel {
        is_quad,
        groups,
        count,
        height,
        shift: 3,
        store,
        sums,
    }
}

#[test]
fn blocks_that_are_stored_are_sums_of_products() {
    for is_quad in [false, true] {
        for groups in [1, 2, 8, 9, 11, 16] {
            for height in 1..=4 {
                for store in [Store::Rectified, Store::Half, Store::Word] {
                    // a block of three halves leaves the next one off a word: it comes once
                    let counts: &[usize] = if height == 3 && store != Store::Word {
                        &[1]
                    } else {
                        &[1, 2, 5]
                    };
                    for count in counts {
                        assert_computes(&kernel(is_quad, groups, (*count, height), store, None));
                    }
                    let uncut = kernel(is_quad, groups, (1, height), store, None);
                    assert_computes(&Kernel { shift: 0, ..uncut });
                }
            }
        }
    }
}

#[test]
fn blocks_that_are_streamed_go_into_every_sum_of_the_last_layer() {
    for is_quad in [false, true] {
        for height in 1..=4 {
            for sums in [1, 2, 3, 5, 8, 9, 10, 11, 18, 19, 20, 27, 64] {
                for count in [1, 3] {
                    assert_computes(&kernel(is_quad, 3, (count, height), Store::Rectified, Some(sums)));
                    assert_computes(&kernel(is_quad, 8, (count, height), Store::Half, Some(sums)));
                }
            }
        }
    }
}

/// Groups are written out up to eight at a time, in turns of equal length.
#[test]
fn the_most_groups_that_divide_all_are_written_out() {
    for (groups, written) in [
        (1, 1),
        (7, 7),
        (8, 8),
        (9, 3),
        (10, 5),
        (11, 1),
        (12, 6),
        (16, 8),
        (26, 2),
    ] {
        for (is_quad, each) in [(false, 1), (true, 2)] {
            let text = kernel(is_quad, groups, (1, 4), Store::Half, None).text(&str::to_owned);
            let products = text.iter().filter(|line| line.starts_with("smlad")).count();
            assert_eq!(products, 4 * each * written, "{groups}");
            assert_eq!(text.contains(&"2:".to_owned()), groups != written, "{groups}");
        }
    }
}

/// As few turns as possible: eight sums and one behind them are written out, ten are taken in two turns.
#[test]
fn up_to_nine_sums_are_added_without_a_loop() {
    let has_loop = |sums: usize| {
        let kernel = kernel(false, 8, (1, 4), Store::Rectified, Some(sums));
        kernel.text(&str::to_owned).contains(&"4:".to_owned())
    };
    assert!((1..=9).all(|sums| !has_loop(sums)));
    assert!((10..=64).all(has_loop));
}
