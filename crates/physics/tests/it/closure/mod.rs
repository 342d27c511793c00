//! Closures against numbers from outside: textbooks, the tables of the paper, IAPWS, and other
//! programs. `V..` names the reference case a number belongs to. Nothing here is our own output.

mod contact;
mod convection;
mod drive;
mod flow;
mod radiation;
mod view;

/// Asserts that `found` is within the relative tolerance of `expected`.
#[track_caller]
fn close(found: f64, expected: f64, relative: f64) {
    let error = (found - expected).abs();
    assert!(
        error <= relative * expected.abs(),
        "found {found:.12e}, expected {expected:.12e}: relative error {:.2e}",
        error / expected.abs()
    );
}
