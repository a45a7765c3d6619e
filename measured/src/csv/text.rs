//! Bytes as text: UTF-8, and UTF-16 as spreadsheets save "Unicode text".

use toml_input::{Faults, FileName, Message, Source};

/// The text without its byte order mark, with line ends `\n` or `\r\n`, and what is to be said of it.
pub(crate) fn decode(name: FileName, bytes: Vec<u8>) -> Result<(Source, Vec<String>), Faults> {
    let mut repairs = Vec::new();
    let bytes = match wide(&bytes) {
        None => bytes,
        Some(Wide::Marked(order)) => {
            repairs.push("read as UTF-16".to_owned());
            decode_wide(&name, &bytes[2..], order)?
        }
        Some(Wide::Unmarked) => {
            let message = Message::new("the file looks like UTF-16 without a byte order mark");
            return Err(name
                .fault(message.expected("UTF-8 text").hint("save it as CSV in UTF-8"))
                .into());
        }
    };
    let mut source = Source::new(name, bytes).map_err(|fault| *fault)?;
    // only where there is no other line end: a CR before an LF is taken off with its line
    if !source.text.contains('\n') && source.text.contains('\r') {
        // line ends of old systems
        source.text = source.text.replace('\r', "\n");
    }
    Ok((source, repairs))
}

/// Order of the bytes of a number.
#[derive(Clone, Copy)]
enum Order {
    Little,
    Big,
}

enum Wide {
    Marked(Order),
    Unmarked,
}

/// UTF-16, by its mark or by every other byte of ASCII being 0.
fn wide(bytes: &[u8]) -> Option<Wide> {
    match bytes {
        [0xff, 0xfe, ..] => Some(Wide::Marked(Order::Little)),
        [0xfe, 0xff, ..] => Some(Wide::Marked(Order::Big)),
        // two characters in a row: a text in UTF-8 holds no zero byte at all
        [0, 1..=255, 0, 1..=255, ..] | [1..=255, 0, 1..=255, 0, ..] => Some(Wide::Unmarked),
        _ => None,
    }
}

fn decode_wide(name: &FileName, bytes: &[u8], order: Order) -> Result<Vec<u8>, Faults> {
    let pairs = bytes.chunks_exact(2).map(|pair| match order {
        Order::Little => u16::from_le_bytes([pair[0], pair[1]]),
        Order::Big => u16::from_be_bytes([pair[0], pair[1]]),
    });
    // `chunks_exact` would drop half a character without a word
    let whole = bytes.len().is_multiple_of(2);
    let text: Result<String, _> = char::decode_utf16(pairs).collect();
    match text {
        Ok(text) if whole => Ok(text.into_bytes()),
        _ => {
            let message = Message::new("the file is UTF-16 text with bytes that are none");
            Err(name.fault(message.hint("save it as CSV in UTF-8")).into())
        }
    }
}
