//! Steps over time: states, and the functions that make, move and read them.

use std::ffi::c_int;

use coldplate_runtime::format::MAX_STATES;
use coldplate_runtime::{State, StepError};

use crate::{DONE, Handle, LENGTH, NULL, NUMBER, STEADY, numbers, places};

/// Numbers in a state (count): `MAX_STATES` states and the last step. Written as a literal, so that a test can compare
/// the header with it.
pub const NUMBERS: usize = 33;
const _: () = assert!(NUMBERS == MAX_STATES + 1);

/// A state over time.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct StateRecord {
    numbers: [f64; NUMBERS],
}

/// Number of states of the machine over time; 0 if the file holds steady states only.
///
/// # Safety
/// `handle` is open, or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_states(handle: *const Handle) -> usize {
    // SAFETY: the caller promises an open handle.
    unsafe { handle.as_ref() }.and_then(|own| own.0.in_time()).map_or(0, |own| own.states())
}

/// The steady state at a condition.
///
/// # Safety
/// Requirements of [`coldplate_evaluate`](crate::coldplate_evaluate); `out` is null or a place for a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_at_rest(handle: *const Handle, x: *const f64, variables: usize, out: *mut StateRecord) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(x)) = (unsafe { handle.as_ref() }, unsafe { numbers(x, variables) }) else { return NULL };
    // SAFETY: the caller promises a place for a state, or null.
    unsafe { put(own.0.at_rest(x), out) }
}

/// The state in which everything has one temperature.
///
/// # Safety
/// `handle` is open, or null; `out` is null or a place for a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_at_temperature(handle: *const Handle, temperature: f64, out: *mut StateRecord) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let Some(own) = (unsafe { handle.as_ref() }) else { return NULL };
    // SAFETY: the caller promises a place for a state, or null.
    unsafe { put(own.0.at_temperature(temperature), out) }
}

/// The most probable state given readings of the points, each with the standard deviation `deviation`. A reading is NaN
/// for a point that is not measured.
///
/// # Safety
/// Requirements of [`coldplate_evaluate`](crate::coldplate_evaluate); `readings` has `points` numbers, `out` is null or
/// a place for a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_at_readings(
    handle: *const Handle,
    x: *const f64,
    variables: usize,
    readings: *const f64,
    points: usize,
    deviation: f64,
    out: *mut StateRecord,
) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(x), Some(readings)) =
        (unsafe { handle.as_ref() }, unsafe { numbers(x, variables) }, unsafe { numbers(readings, points) })
    else {
        return NULL;
    };
    // SAFETY: the caller promises a place for a state, or null.
    unsafe { put(own.0.at_readings(x, readings, deviation), out) }
}

/// Moves a state by a duration (s) at a constant condition.
///
/// # Safety
/// Requirements of [`coldplate_evaluate`](crate::coldplate_evaluate); `state` is null or a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_step(
    handle: *const Handle,
    state: *mut StateRecord,
    duration: f64,
    x: *const f64,
    variables: usize,
) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(record), Some(x)) = (unsafe { handle.as_ref() }, unsafe { state.as_mut() }, unsafe { numbers(x, variables) })
    else {
        return NULL;
    };
    let mut moved = State::from_numbers(&record.numbers);
    match own.0.step(&mut moved, duration, x) {
        Ok(()) => {
            record.numbers = moved.numbers();
            DONE
        }
        Err(error) => refused(error),
    }
}

/// Readings of the points in a state at a condition.
///
/// # Safety
/// Requirements of [`coldplate_evaluate`](crate::coldplate_evaluate); `state` is null or a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_read(
    handle: *const Handle,
    state: *const StateRecord,
    x: *const f64,
    variables: usize,
    values: *mut f64,
    points: usize,
) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(record), Some(x), Some(values)) =
        (unsafe { handle.as_ref() }, unsafe { state.as_ref() }, unsafe { numbers(x, variables) }, unsafe { places(values, points) })
    else {
        return NULL;
    };
    own.0.read(&State::from_numbers(&record.numbers), x, values).map_or_else(refused, |()| DONE)
}

fn refused(error: StepError) -> c_int {
    match error {
        StepError::NotInTime => STEADY,
        StepError::Shape(_) => LENGTH,
        StepError::Number => NUMBER,
    }
}

/// Writes a new state to `out`, or returns the code of the error.
///
/// # Safety
/// `out` is null or a place for a state.
unsafe fn put(made: Result<State, StepError>, out: *mut StateRecord) -> c_int {
    // SAFETY: the caller promises a place for a state, or null.
    let Some(out) = (unsafe { out.as_mut() }) else { return NULL };
    match made {
        Ok(state) => {
            out.numbers = state.numbers();
            DONE
        }
        Err(error) => refused(error),
    }
}
