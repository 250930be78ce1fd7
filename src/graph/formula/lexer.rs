//! The words of a formula.

use super::Fault;

/// What a word is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Number(f64),
    Name,
    Operator(Operator),
    Open,
    Close,
    Comma,
    /// Behind the last word.
    End,
}

/// What stands between two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    Add,
    Sub,
    Mul,
    Div,
    Power,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
}

impl Operator {
    /// Higher binds tighter; the minus sign of one value is 4.
    pub fn precedence(self) -> u8 {
        match self {
            Self::Less | Self::LessEqual | Self::Greater | Self::GreaterEqual => 1,
            Self::Add | Self::Sub => 2,
            Self::Mul | Self::Div => 3,
            Self::Power => 5,
        }
    }
}

/// A word and its bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Word {
    pub kind: Kind,
    pub start: usize,
    pub end: usize,
}

/// The word that begins at or behind byte `from`; the fault carries the byte where it is.
pub fn next(text: &str, from: usize) -> Result<Word, (Fault, usize)> {
    let rest = &text[from..];
    let start = from + (rest.len() - rest.trim_start().len());
    let rest = &text[start..];
    let word = |kind, length| Ok(Word { kind, start, end: start + length });
    let Some(first) = rest.chars().next() else { return word(Kind::End, 0) };
    let followed_by = |letter: char| rest[first.len_utf8()..].starts_with(letter);
    let operator = |operator, length| word(Kind::Operator(operator), length);
    let instead = |found: &str, remedy| Err((Fault::Letter { found: found.into(), remedy }, start));
    match first {
        '0'..='9' | '.' => {
            let length = number_length(rest.as_bytes());
            let number = rest[..length].parse::<f64>().ok().filter(|n| n.is_finite());
            match number {
                Some(number) => word(Kind::Number(number), length),
                None => Err((Fault::Number { text: super::fault::short(&rest[..length]) }, start)),
            }
        }
        '(' => word(Kind::Open, 1),
        ')' => word(Kind::Close, 1),
        ',' => word(Kind::Comma, 1),
        '+' => operator(Operator::Add, 1),
        '-' => operator(Operator::Sub, 1),
        '*' if followed_by('*') => instead("**", "write `^` for powers"),
        '*' => operator(Operator::Mul, 1),
        '/' => operator(Operator::Div, 1),
        '^' => operator(Operator::Power, 1),
        '<' if followed_by('=') => operator(Operator::LessEqual, 2),
        '<' => operator(Operator::Less, 1),
        '>' if followed_by('=') => operator(Operator::GreaterEqual, 2),
        '>' => operator(Operator::Greater, 1),
        '=' => instead("=", "a formula is one value: compare with < <= > >="),
        '[' | ']' | '{' | '}' => instead(&first.to_string(), "write round parentheses"),
        '|' => instead("|", "write `abs(…)`"),
        '%' => instead("%", "write `mod(a, b)`"),
        ';' => instead(";", "a formula is one value: separate arguments with `,`"),
        '−' | '–' => instead(&first.to_string(), "write `-`"),
        '·' | '×' => instead(&first.to_string(), "write `*`"),
        '²' => instead("²", "write `^2`"),
        '³' => instead("³", "write `^3`"),
        letter if starts_name(letter) => {
            word(Kind::Name, rest.find(|c| !continues_name(c)).unwrap_or(rest.len()))
        }
        other => instead(
            &other.escape_debug().to_string(),
            "a formula has numbers, names, + - * / ^ < <= > >= ( ) and ,",
        ),
    }
}

pub(super) fn starts_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

pub(super) fn continues_name(c: char) -> bool {
    starts_name(c) || c.is_ascii_digit()
}

/// Digits, a point, digits; and an exponent if digits follow its sign.
fn number_length(bytes: &[u8]) -> usize {
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut length = digits(0);
    if bytes.get(length) == Some(&b'.') {
        length += 1 + digits(length + 1);
    }
    if matches!(bytes.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
        let from = (length + 1 + sign).min(bytes.len());
        if digits(from) > 0 {
            length = from + digits(from);
        }
    }
    length
}
