//! What can be wrong with a formula.

use super::functions::FUNCTIONS;

/// Why a text is no formula, and where.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{fault}\n{excerpt}")]
pub struct FormulaError {
    /// What is wrong.
    pub fault: Fault,
    /// The byte of the text where it is.
    pub at: usize,
    /// The line with a caret under the place.
    pub excerpt: String,
}

/// What is wrong with a formula.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// Nothing but spaces.
    #[error("the formula is empty: write one, as in `sqrt(x^2 + y^2 + z^2) - 1`")]
    Empty,
    /// Something that no formula has.
    #[error("`{found}` has no meaning in a formula: {remedy}")]
    Letter {
        /// What stands there.
        found: String,
        /// What to write.
        remedy: &'static str,
    },
    /// A number that is none, or none that is finite.
    #[error("`{text}` is no finite number: write it like 0.5 or 1e-3")]
    Number {
        /// What stands there.
        text: String,
    },
    /// Two values side by side.
    #[error("an operator is missing before `{right}`: did you mean `{left}*{right}`?")]
    NoOperator {
        /// The end of the value before.
        left: String,
        /// What follows it.
        right: String,
    },
    /// A value is missing.
    #[error("a value is missing before {before}: write a number, a name or a parenthesis there")]
    NoValue {
        /// What stands in its place.
        before: String,
    },
    /// No such parameter.
    #[error("no value is given for `{name}`{}; there are x, y, z, pi, tau, e{}", meant(.closest), also(.known))]
    UnknownName {
        /// The name.
        name: String,
        /// A known name that looks like it.
        closest: Option<String>,
        /// The parameters.
        known: Vec<String>,
    },
    /// No such function.
    #[error("there is no function `{name}`{}; there are {}", meant(.closest), function_names())]
    UnknownFunction {
        /// The name.
        name: String,
        /// A known name that looks like it.
        closest: Option<String>,
    },
    /// A number that is called.
    #[error("`{name}` is no function: did you mean `{name}*(`?")]
    NotAFunction {
        /// The name.
        name: String,
    },
    /// A function that is not called.
    #[error("`{name}` is a function: write its arguments behind it, as in `{name}(x)`")]
    NoArguments {
        /// The name.
        name: &'static str,
    },
    /// Too many or too few arguments.
    #[error("`{name}` has {found} arguments here: it takes {}", arguments(*.least, *.most))]
    ArgumentCount {
        /// The function.
        name: &'static str,
        /// How many were given.
        found: usize,
        /// The fewest it takes.
        least: usize,
        /// The most it takes.
        most: usize,
    },
    /// A parenthesis that nothing closes.
    #[error("this parenthesis is not closed: add `)`")]
    NotClosed,
    /// A parenthesis that closes nothing.
    #[error("this `)` closes nothing: remove it, or open a parenthesis before")]
    NotOpen,
    /// A comma that separates no arguments.
    #[error("this `,` stands in no function's arguments: write a point in numbers, as in 0.5, or remove it")]
    Comma,
    /// A comparison of a comparison.
    #[error("comparisons cannot be chained: write `(a < b) * (b < c)`")]
    Chain,
    /// A constant part that is no finite number.
    #[error("this gives {value} everywhere: change its operands")]
    NotFinite {
        /// Its value.
        value: f64,
    },
    /// A parameter that is NaN or infinite.
    #[error("the parameter `{name}` is {value:e}: give a finite 32-bit number, up to 3.4e38")]
    Parameter {
        /// The parameter.
        name: String,
        /// What was given.
        value: f64,
    },
    /// A parameter with a name that means something else.
    #[error("`{name}` has a meaning of its own in formulas: give the parameter another name")]
    Reserved {
        /// The name.
        name: String,
    },
}

fn meant(closest: &Option<String>) -> String {
    closest.as_ref().map_or(String::new(), |name| format!(" (did you mean `{name}`?)"))
}

fn also(names: &[String]) -> String {
    if names.is_empty() {
        " and no parameters: give it a value as a parameter (in a scene below `[parameters]`)".into()
    } else {
        format!(" and the parameters {}", listed(names))
    }
}

fn function_names() -> String {
    FUNCTIONS.iter().map(|f| f.name).collect::<Vec<_>>().join(" ")
}

fn arguments(least: usize, most: usize) -> String {
    if least == most { least.to_string() } else { format!("{least} or more") }
}

/// Names for a message, of many the first.
pub fn listed(names: &[String]) -> String {
    const MOST: usize = 40;
    let more = names.len().saturating_sub(MOST);
    let end = if more > 0 { format!(", … ({more} more)") } else { String::new() };
    names[..names.len() - more].join(", ") + &end
}

/// A word of the user's for a message.
pub fn short(text: &str) -> String {
    const MOST: usize = 40;
    let mut out: String = text.chars().take(MOST).collect();
    if out.len() < text.len() {
        out.push('…');
    }
    out
}

/// The known name that needs the fewest changes of letters to become `name`, if they are few.
pub fn closest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let letters: Vec<char> = name.chars().take(64).collect();
    let distance = |other: &str| {
        let mut row: Vec<usize> = (0..=letters.len()).collect();
        for (i, b) in other.chars().enumerate() {
            let mut diagonal = std::mem::replace(&mut row[0], i + 1);
            for (j, a) in letters.iter().enumerate() {
                let change = diagonal + usize::from(a.to_lowercase().ne(b.to_lowercase()));
                diagonal = row[j + 1];
                row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
            }
        }
        row[letters.len()]
    };
    let few = |other: &str| (letters.len().max(other.chars().count()) - 1).div_ceil(3).min(2);
    let near = known.map(|other| (distance(other), other)).filter(|&(d, other)| d <= few(other));
    near.min_by_key(|&(d, _)| d).map(|(_, other)| other.into())
}
