//! Formulas of the time, as `1e-3*sin(2*pi*50*t)`.
//!
//! Our own parser, because the crates that are kept up give other results than a reader of the formula expects (decision 040). All
//! functions come from [`libm`], so that a value has the same bits on every machine and after a restart.

use std::f64::consts::PI;

/// Longest formula, characters.
const LONGEST: usize = 1000;

/// Deepest nesting of parentheses, signs, and powers.
const DEEPEST: usize = 50;

/// A formula of the time.
///
/// ```
/// use concordem_scenario::schedule::Expression;
///
/// let ramp = Expression::parse("min(t/2e-3, 1)^2")?;
/// assert_eq!(ramp.at(1e-3), 0.25);
/// assert_eq!(Expression::parse("-t^2")?.at(3.0), -9.0);
/// let fault = Expression::parse("2*sine(t)").unwrap_err();
/// assert_eq!((fault.at, &fault.message[..]), (2, "`sine` is no function"));
/// # Ok::<(), concordem_scenario::schedule::ExpressionFault>(())
/// ```
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    /// Operations in the order of their evaluation on a stack.
    operations: Vec<Operation>,
}

/// What is wrong with a formula.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("at character {}: {message}; {help}", at + 1)]
pub struct ExpressionFault {
    /// Where, in bytes from the start of the formula.
    pub at: usize,
    /// What.
    pub message: String,
    /// The remedy.
    pub help: String,
}

/// An operation on a stack.
#[derive(Debug, Clone, Copy)]
enum Operation {
    Number(f64),
    Time,
    /// Replaces the top.
    Unary(fn(f64) -> f64),
    /// Replaces the two at the top.
    Binary(fn(f64, f64) -> f64),
}

/// A function of a formula: name and operation.
type Function = (&'static str, Operation);

const FUNCTIONS: [Function; 21] = [
    ("abs", Operation::Unary(libm::fabs)),
    ("acos", Operation::Unary(libm::acos)),
    ("asin", Operation::Unary(libm::asin)),
    ("atan", Operation::Unary(libm::atan)),
    ("atan2", Operation::Binary(libm::atan2)),
    ("cos", Operation::Unary(libm::cos)),
    ("cosh", Operation::Unary(libm::cosh)),
    ("exp", Operation::Unary(libm::exp)),
    ("floor", Operation::Unary(libm::floor)),
    ("ln", Operation::Unary(libm::log)),
    ("log10", Operation::Unary(libm::log10)),
    ("max", Operation::Binary(libm::fmax)),
    ("min", Operation::Binary(libm::fmin)),
    ("mod", Operation::Binary(modulo)),
    ("sign", Operation::Unary(sign)),
    ("sin", Operation::Unary(libm::sin)),
    ("sinh", Operation::Unary(libm::sinh)),
    ("sqrt", Operation::Unary(libm::sqrt)),
    ("step", Operation::Unary(step)),
    ("tan", Operation::Unary(libm::tan)),
    ("tanh", Operation::Unary(libm::tanh)),
];

/// The rest of a division, with the sign of the divisor: `mod(t, 2)` repeats from 0 to 2.
fn modulo(x: f64, y: f64) -> f64 {
    x - y * libm::floor(x / y)
}

fn sign(x: f64) -> f64 {
    step(x) - step(-x)
}

/// 0 below zero, 1 from zero on.
fn step(x: f64) -> f64 {
    if x < 0.0 { 0.0 } else { 1.0 }
}

impl Expression {
    /// Reads a formula.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn parse(text: &str) -> Result<Self, ExpressionFault> {
        let mut reader = Reader { text, at: 0, depth: 0, operations: Vec::new() };
        if text.len() > LONGEST {
            return Err(reader.fault(format!("is longer than {LONGEST} characters"), "write a table of points"));
        }
        reader.sum()?;
        match reader.next() {
            None => Ok(Self { text: text.to_owned(), operations: reader.operations }),
            Some(b')') => Err(reader.fault("no parenthesis is open here", "remove it, or open one before")),
            Some(_) => {
                let message = format!("there is no operator before `{}`", reader.word());
                Err(reader.fault(message, "write + - * / ^ between two values: 2*t, not 2 t"))
            }
        }
    }

    /// The value at the time `t` (s).
    pub fn at(&self, t: f64) -> f64 {
        let mut stack = Vec::with_capacity(self.operations.len());
        for operation in &self.operations {
            let value = match operation {
                Operation::Number(number) => *number,
                Operation::Time => t,
                Operation::Unary(function) => function(stack.pop().unwrap_or(f64::NAN)),
                Operation::Binary(function) => {
                    let y = stack.pop().unwrap_or(f64::NAN);
                    function(stack.pop().unwrap_or(f64::NAN), y)
                }
            };
            stack.push(value);
        }
        stack.pop().unwrap_or(f64::NAN)
    }
}

impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

/// Reads a formula by recursive descent.
struct Reader<'a> {
    text: &'a str,
    /// Bytes read.
    at: usize,
    depth: usize,
    operations: Vec<Operation>,
}

impl Reader<'_> {
    fn fault(&self, message: impl Into<String>, help: &str) -> ExpressionFault {
        ExpressionFault { at: self.at, message: message.into(), help: help.to_owned() }
    }

    /// The next byte that is no space.
    fn next(&mut self) -> Option<u8> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        self.text.as_bytes().get(self.at).copied()
    }

    /// Reads `byte` if it comes next.
    fn take(&mut self, byte: u8) -> bool {
        let found = self.next() == Some(byte);
        self.at += usize::from(found);
        found
    }

    /// The name or the character that comes next.
    fn word(&self) -> &str {
        let rest = &self.text[self.at..];
        let length = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let first = rest.chars().next().map_or(0, char::len_utf8);
        &rest[..length.max(first)]
    }

    fn binary(&mut self, function: fn(f64, f64) -> f64) {
        self.operations.push(Operation::Binary(function));
    }

    fn sum(&mut self) -> Result<(), ExpressionFault> {
        self.product()?;
        loop {
            if self.take(b'+') {
                self.product()?;
                self.binary(|x, y| x + y);
            } else if self.take(b'-') {
                self.product()?;
                self.binary(|x, y| x - y);
            } else {
                return Ok(());
            }
        }
    }

    fn product(&mut self) -> Result<(), ExpressionFault> {
        self.signed()?;
        loop {
            if self.text[self.at..].trim_start().starts_with("**") {
                self.next();
                return Err(self.fault("`**` is no operator", "write ^ for a power: t^2"));
            }
            if self.take(b'*') {
                self.signed()?;
                self.binary(|x, y| x * y);
            } else if self.take(b'/') {
                self.signed()?;
                self.binary(|x, y| x / y);
            } else {
                return Ok(());
            }
        }
    }

    /// A power with a sign, as in mathematics: `-t^2` is `-(t^2)`, `2^3^2` is `2^(3^2)`, and `2^-1` is 0.5.
    fn signed(&mut self) -> Result<(), ExpressionFault> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.fault(format!("is nested more than {DEEPEST} deep"), "write it with fewer parentheses"));
        }
        if self.take(b'-') {
            self.signed()?;
            self.operations.push(Operation::Unary(|x| -x));
        } else if self.take(b'+') {
            self.signed()?;
        } else {
            self.value()?;
            if self.take(b'^') {
                self.signed()?;
                self.binary(libm::pow);
            }
        }
        self.depth -= 1;
        Ok(())
    }

    fn value(&mut self) -> Result<(), ExpressionFault> {
        const VALUES: &str = "write a number, t, pi, or a function such as sin(t)";
        match self.next() {
            None => Err(self.fault("ends where a value is missing", VALUES)),
            Some(b'(') => {
                self.at += 1;
                self.sum()?;
                self.close()
            }
            Some(b'0'..=b'9' | b'.') => self.number(),
            Some(byte) if byte.is_ascii_alphabetic() => self.name(),
            Some(_) => {
                let message = format!("`{}` stands where a value is missing", self.word());
                Err(self.fault(message, VALUES))
            }
        }
    }

    fn close(&mut self) -> Result<(), ExpressionFault> {
        if self.take(b')') {
            return Ok(());
        }
        let message = if self.next().is_none() {
            "ends before a parenthesis is closed".to_owned()
        } else {
            format!("`{}` stands where an operator or `)` is missing", self.word())
        };
        Err(self.fault(message, "write `)` after the last value of the parenthesis"))
    }

    fn number(&mut self) -> Result<(), ExpressionFault> {
        let bytes = self.text.as_bytes();
        let digits = |from: usize| from + bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        let mut end = digits(self.at);
        if bytes.get(end) == Some(&b'.') {
            end = digits(end + 1);
        }
        // An exponent only if digits follow.
        if matches!(bytes.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            let last = digits((end + 1 + sign).min(bytes.len()));
            if last > end + 1 + sign {
                end = last;
            }
        }
        match self.text[self.at..end].parse::<f64>() {
            Ok(number) if number.is_finite() => {
                self.operations.push(Operation::Number(number));
                self.at = end;
                Ok(())
            }
            _ => Err(self.fault(format!("`{}` is no number", &self.text[self.at..end]), "write it as 0.5 or 1e-3")),
        }
    }

    fn name(&mut self) -> Result<(), ExpressionFault> {
        let name = self.word().to_owned();
        let is_called = self.text[self.at + name.len()..].trim_start().starts_with('(');
        let function = FUNCTIONS.iter().find(|(known, _)| *known == name);
        match (&name[..], function, is_called) {
            ("t", _, false) => self.operations.push(Operation::Time),
            ("pi", _, false) => self.operations.push(Operation::Number(PI)),
            (_, Some((_, operation)), true) => return self.call(&name, *operation),
            (_, Some(_), false) => {
                self.at += name.len();
                return Err(
                    self.fault(format!("`{name}` needs its argument in parentheses"), "write for example sin(t)")
                );
            }
            (_, None, true) => {
                let known: Vec<&str> = FUNCTIONS.iter().map(|(known, _)| *known).collect();
                let help = format!("the functions are {}", known.join(", "));
                return Err(self.fault(format!("`{name}` is no function"), &help));
            }
            (_, None, false) => {
                return Err(self.fault(format!("`{name}` is no name"), "the names are t, the time in seconds, and pi"));
            }
        }
        self.at += name.len();
        Ok(())
    }

    fn call(&mut self, name: &str, operation: Operation) -> Result<(), ExpressionFault> {
        self.at += name.len();
        self.take(b'(');
        self.sum()?;
        let needs_two = matches!(operation, Operation::Binary(_));
        match (self.next() == Some(b','), needs_two) {
            (true, true) => {
                self.at += 1;
                self.sum()?;
            }
            (true, false) => return Err(self.fault(format!("`{name}` has one argument"), "remove the second one")),
            (false, true) => {
                let help = format!("write {name}(x, y)");
                return Err(self.fault(format!("`{name}` needs two arguments"), &help));
            }
            (false, false) => {}
        }
        if self.next() == Some(b',') {
            return Err(self.fault(format!("`{name}` has two arguments"), "nest them: min(min(x, y), z)"));
        }
        self.close()?;
        self.operations.push(operation);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Precedence, associativity, signs, and functions as in mathematics. Exact: the same operations in the same order.
    #[test]
    fn formulas_mean_what_mathematics_means() {
        let t = 0.7_f64;
        for (text, value) in [
            ("1 + 2*3 - 4/2", 5.0),
            ("10 - 4 - 3", 3.0),
            ("16/4/2", 2.0),
            ("-2^2", -4.0),
            ("(-2)^2", 4.0),
            ("2^3^2", 512.0),
            ("2^-1", 0.5),
            ("2*-3", -6.0),
            ("2--3", 5.0),
            ("-sin(t)^2", -libm::pow(libm::sin(t), 2.0)),
            (" 2e-3*3", 2e-3 * 3.0),
            (".5E+1", 5.0),
            ("1e-3*sin(2*pi*50*t)", 1e-3 * libm::sin(2.0 * PI * 50.0 * t)),
            ("atan2(1, atan2(2, 3)) + 1", libm::atan2(1.0, libm::atan2(2.0, 3.0)) + 1.0),
            ("min(max(t, 0.1), 1)", t),
            ("step(t - 0.7) + step(t - 0.8) + sign(-t) + sign(0)", 0.0),
            ("mod(-0.5, 2) + floor(1.5) + abs(-2)", 4.5),
            ("sqrt(exp(ln(4)*1)) - log10(100)", libm::sqrt(libm::exp(libm::log(4.0))) - 2.0),
            ("tan(t) - sinh(t)*cosh(t)*tanh(t)", libm::tan(t) - libm::sinh(t) * libm::cosh(t) * libm::tanh(t)),
            ("asin(t) + acos(t) - atan(t)", libm::asin(t) + libm::acos(t) - libm::atan(t)),
        ] {
            let found = Expression::parse(text).unwrap_or_else(|fault| panic!("{text}: {fault}")).at(t);
            assert_eq!(found.to_bits(), value.to_bits(), "{text}: {found} {value}");
        }
    }

    /// A faulty formula names the place of the fault.
    #[test]
    fn faults_have_a_place() {
        let deep = "(".repeat(2000);
        let signs = "-".repeat(900);
        for (text, at, message) in [
            ("", 0, "ends where a value"),
            ("2 t", 2, "no operator before `t`"),
            ("sin t", 3, "needs its argument"),
            ("2*(t+1", 6, "ends before"),
            ("2*(t 1)", 5, "`1` stands where an operator"),
            ("t)", 1, "no parenthesis is open"),
            ("t**2", 1, "`**` is no operator"),
            ("t^", 2, "ends where a value"),
            ("2*x", 2, "`x` is no name"),
            ("2*foo(t)", 2, "`foo` is no function"),
            ("sin(t, 2)", 5, "has one argument"),
            ("min(t)", 5, "needs two arguments"),
            ("min(t, 1, 2)", 8, "has two arguments"),
            ("1e999", 0, "is no number"),
            ("1.2.3", 3, "no operator before `.`"),
            (".", 0, "is no number"),
            ("2e*t", 1, "no operator before `e`"),
            ("3*µ", 2, "`µ` stands where a value"),
            ("sin(2π t)", 5, "`π` stands where an operator"),
            (&signs, 50, "nested more than"),
            (&deep, 0, "is longer than"),
        ] {
            let fault = Expression::parse(text).expect_err(text);
            assert_eq!((fault.at, fault.message.contains(message)), (at, true), "{text}: {fault}");
        }
    }

    /// Cut off and mixed formulas are read or refused; evaluation needs no more than the stack.
    #[test]
    fn any_text_is_read_or_refused() {
        let pieces =
            ["t", "sin(", "min(", ",", ")", "(", "+", "-", "*", "/", "^", "2e-3", ".", "pi", " ", "é", "e", "**"];
        let mut number = 12_345_u64;
        for _ in 0..20_000 {
            let mut text = String::new();
            for _ in 0..12 {
                number = number.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                text.push_str(pieces[(number >> 33) as usize % pieces.len()]);
            }
            match Expression::parse(&text) {
                Ok(expression) => {
                    expression.at(0.3);
                }
                Err(fault) => assert!(text.is_char_boundary(fault.at), "{text}"),
            }
        }
    }
}
