//! Lines of a file that are wrong: the first one in full, and the numbers of the others, so that a user mends them all at once.

use super::PackingError;

/// Numbers of further lines that a message lists.
const LISTED: usize = 5;

/// The lines that have been wrong so far.
#[derive(Default)]
pub(crate) struct BadLines {
    first: Option<PackingError>,
    /// Numbers of the next ones, at most [`LISTED`].
    others: Vec<usize>,
    count: usize,
}

impl BadLines {
    /// What line `number` gives; `None` if it is wrong.
    pub(crate) fn keep<T>(&mut self, number: usize, found: Result<T, PackingError>) -> Option<T> {
        match found {
            Ok(found) => return Some(found),
            Err(error) if self.first.is_none() => self.first = Some(error),
            Err(_) => {
                self.count += 1;
                if self.others.len() < LISTED {
                    self.others.push(number);
                }
            }
        }
        None
    }

    /// # Errors
    /// A line was wrong.
    pub(crate) fn end(self) -> Result<(), PackingError> {
        let Some(mut first) = self.first else { return Ok(()) };
        if let (PackingError::BadLine { others, .. }, true) = (&mut first, self.count > 0) {
            let (lines, are) = if self.count == 1 { ("line", "is") } else { ("lines", "are") };
            let numbers: Vec<String> = self.others.iter().map(usize::to_string).collect();
            let rest = if self.count > numbers.len() { ", ..." } else { "" };
            *others = format!("; {} more {lines} {are} wrong: {}{rest}", self.count, numbers.join(", "));
        }
        Err(first)
    }
}
