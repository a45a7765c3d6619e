//! Zip archives with stored members.

use random::{Random, SplitMix};

use super::Change;

/// Archives within archives: stable-baselines3 has one in another.
const DEEPEST: usize = 2;

/// A member: name and content.
pub type Member = (Vec<u8>, Vec<u8>);

/// The members of an archive; `None` if it is none, or holds a compressed one.
#[must_use]
pub fn unpack(bytes: &[u8]) -> Option<Vec<Member>> {
    let end = bytes.windows(4).rposition(|four| four == b"PK\x05\x06")?;
    let mut at = number(bytes, end + 16, 4)?;
    let mut members = Vec::new();
    for _ in 0..number(bytes, end + 10, 2)? {
        let (name, extra, comment) = (
            number(bytes, at + 28, 2)?,
            number(bytes, at + 30, 2)?,
            number(bytes, at + 32, 2)?,
        );
        let (method, size, local) = (
            number(bytes, at + 10, 2)?,
            number(bytes, at + 24, 4)?,
            number(bytes, at + 42, 4)?,
        );
        if method != 0 {
            return None;
        }
        let start = local + 30 + number(bytes, local + 26, 2)? + number(bytes, local + 28, 2)?;
        let data = bytes.get(start..start + size)?.to_vec();
        members.push((bytes.get(at + 46..at + 46 + name)?.to_vec(), data));
        at += 46 + name + extra + comment;
    }
    Some(members)
}

/// An archive of these members, stored. Its check sums are 0: the readers here look at none.
#[must_use]
pub fn pack(members: &[Member]) -> Vec<u8> {
    let (mut bytes, mut rows) = (Vec::new(), Vec::new());
    for (name, data) in members {
        // sizes and counts of inputs are far below the width of their fields
        let sizes = [(data.len() as u32).to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
        let names = [(name.len() as u16).to_le_bytes(), [0, 0]].concat();
        let local = bytes.len() as u32;
        bytes.extend([&b"PK\x03\x04\x14\0"[..], &[0; 12], &sizes, &names, name, data].concat());
        rows.extend([&b"PK\x01\x02\x14\0\x14\0"[..], &[0; 12], &sizes, &names, &[0; 10]].concat());
        rows.extend([&local.to_le_bytes()[..], name].concat());
    }
    let count = (members.len() as u16).to_le_bytes();
    let directory = [(rows.len() as u32).to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
    [
        &bytes[..],
        &rows,
        b"PK\x05\x06\0\0\0\0",
        &count,
        &count,
        &directory,
        &[0, 0],
    ]
    .concat()
}

pub(super) fn edit(input: &[u8], random: &mut SplitMix, change: &Change<'_>) -> Option<Vec<u8>> {
    within(input, random, change, DEEPEST)
}

fn within(input: &[u8], random: &mut SplitMix, change: &Change<'_>, left: usize) -> Option<Vec<u8>> {
    let mut members = unpack(input)?;
    let count = members.len();
    match random.below(24) {
        0 => drop(members.swap_remove(random.below(count))),
        1 => members.push(members.get(random.below(count))?.clone()),
        2 => change(&mut members.get_mut(random.below(count))?.0, random),
        _ => {
            // what is read is a program, JSON or an archive; the many others are numbers
            let is_read = |member: &Member| {
                [&b".pkl"[..], b".pth", b"data"]
                    .iter()
                    .any(|end| member.0.ends_with(end))
            };
            let read: Vec<usize> = (0..count).filter(|index| is_read(&members[*index])).collect();
            let index = match random.one_in(6) {
                true => random.below(count),
                false => random.pick(&read, 0),
            };
            let (_, data) = members.get_mut(index)?;
            match left.checked_sub(1).and_then(|left| within(data, random, change, left)) {
                Some(edited) => *data = edited,
                None => change(data, random),
            }
        }
    }
    Some(pack(&members))
}

fn number(bytes: &[u8], at: usize, width: usize) -> Option<usize> {
    let place = bytes.get(at..at + width)?;
    Some(
        place
            .iter()
            .rev()
            .fold(0, |number, byte| number << 8 | usize::from(*byte)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_packed_is_unpacked() {
        let members = vec![
            (b"a/data.pkl".to_vec(), b"program".to_vec()),
            (b"b".to_vec(), Vec::new()),
        ];
        assert_eq!(unpack(&pack(&members)).unwrap(), members);
    }
}
