//! What all lists of knots must be.

use crate::error::{Error, Result};

/// Checks where the knots of the function `what` are.
///
/// # Errors
/// [`Error::Transfer`] if there is none, one is not finite, or they do not ascend.
pub(super) fn check(what: &str, places: impl Iterator<Item = f64>) -> Result<()> {
    let s: Vec<f64> = places.collect();
    if s.is_empty() {
        return Err(Error::Transfer(format!("the {what} function has no knot")));
    }
    if let Some(i) = s.iter().position(|x| !x.is_finite()) {
        return Err(Error::Transfer(format!("{what} knot {i} is at {}", s[i])));
    }
    if let Some(i) = s.windows(2).position(|w| w[1] < w[0]) {
        let what = format!("{what} knot {} at {} comes after {}: knots must ascend", i + 1, s[i + 1], s[i]);
        return Err(Error::Transfer(what));
    }
    Ok(())
}
