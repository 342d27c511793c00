//! The runtime for programs in C and every language that calls C; `include/coldplate.h` says what each function does.
//!
//! This crate alone of the workspace uses `unsafe`: pointers from C cannot be checked by the compiler. Every function
//! refuses null pointers; the caller must make sure that every other pointer is as the header asks. A handle is never
//! written to after opening: several threads may use it at once. Opening takes memory for the handle, and a batch while
//! it lasts; no other function takes any.
#![warn(missing_docs)]

mod steps;

use std::ffi::{c_char, c_int};
use std::{ptr, slice};

use coldplate_runtime::{Acceptability, Band, LimitValue, OpenError, Surrogate};

/// Return code: success.
const DONE: c_int = 0;
/// Return code: a pointer is null.
const NULL: c_int = 1;
/// Return code: the bytes are no surrogate file.
const NOT_A_SURROGATE: c_int = 2;
/// Return code: the version of the layout is unknown.
const VERSION: c_int = 3;
/// Return code: the file is damaged.
const DAMAGED: c_int = 4;
/// Return code: the file is malformed.
const MALFORMED: c_int = 5;
/// Return code: a self-test is not reproduced.
const SELF_TEST: c_int = 6;
/// Return code: an array has a wrong length.
const LENGTH: c_int = 7;
/// Return code: an index is out of range.
const INDEX: c_int = 8;
/// Return code: the confidence is out of range.
const CONFIDENCE: c_int = 9;
/// Return code: the file holds steady states only.
const STEADY: c_int = 10;
/// Return code: a number is not finite or out of range.
const NUMBER: c_int = 11;

/// Texts of the codes above, each ended by a zero.
const TEXTS: [&[u8]; 12] = [
    b"done\0",
    b"a pointer is null\0",
    b"this is not a surrogate file\0",
    b"the layout version is one that this library does not know\0",
    b"the file is cut off or damaged\0",
    b"the file is malformed\0",
    b"this build does not reproduce the self-test vectors of the file\0",
    b"an array has not the length it must have\0",
    b"there is no variable, point or limit of this index\0",
    b"a confidence lies between one half and one\0",
    b"this surrogate knows steady states only\0",
    b"a number is not finite, or a duration or deviation is negative\0",
];

/// An opened surrogate.
pub struct Handle(Surrogate<'static>);

/// A text in the file: not ended by a zero.
#[repr(C)]
pub struct Text {
    data: *const c_char,
    length: usize,
}

/// Name, unit and range of a variable, or name, unit and half width (in both ends) of a point.
#[repr(C)]
pub struct Entry {
    name: Text,
    unit: Text,
    low: f64,
    high: f64,
}

/// Standard deviations of a value; `fit` is that of the fit and of the mesh together.
#[repr(C)]
pub struct BandRecord {
    fit: f64,
    parameters: f64,
    misses: f64,
    total: f64,
}

/// A limit at a condition.
#[repr(C)]
pub struct LimitRecord {
    value: f64,
    low: f64,
    high: f64,
    maximum: f64,
    margin: f64,
    probability: f64,
    state: c_int,
}

/// A verdict.
#[repr(C)]
pub struct VerdictRecord {
    state: c_int,
    in_domain: c_int,
    binding: c_int,
    probability: f64,
}

fn text(text: &str) -> Text {
    Text { data: text.as_ptr().cast(), length: text.len() }
}

fn state(state: Acceptability) -> c_int {
    state as c_int
}

/// The text of a code; an unknown code gets the text for a null pointer.
#[unsafe(no_mangle)]
pub extern "C" fn coldplate_error_text(code: c_int) -> *const c_char {
    let known = usize::try_from(code).ok().and_then(|code| TEXTS.get(code));
    known.map_or(c"unknown code".as_ptr(), |text| text.as_ptr().cast())
}

/// Opens a file that lies in memory.
///
/// # Safety
/// `bytes` points to `length` bytes that do not change until the handle is closed; `out` points to a place for a
/// handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_open(bytes: *const u8, length: usize, out: *mut *mut Handle) -> c_int {
    if bytes.is_null() || out.is_null() {
        return NULL;
    }
    // SAFETY: the caller promises that the bytes are there and stay.
    let bytes: &'static [u8] = unsafe { slice::from_raw_parts(bytes, length) };
    let (handle, code) = match Surrogate::open(bytes) {
        Ok(surrogate) => (Box::into_raw(Box::new(Handle(surrogate))), DONE),
        Err(OpenError::NotASurrogate) => (ptr::null_mut(), NOT_A_SURROGATE),
        Err(OpenError::Version(_)) => (ptr::null_mut(), VERSION),
        Err(OpenError::Length | OpenError::Checksum) => (ptr::null_mut(), DAMAGED),
        Err(OpenError::SelfTest { .. }) => (ptr::null_mut(), SELF_TEST),
        Err(_) => (ptr::null_mut(), MALFORMED),
    };
    // SAFETY: the caller promises a place for the handle.
    unsafe { out.write(handle) };
    code
}

/// Closes a handle; does nothing for a null pointer.
///
/// # Safety
/// `handle` came from [`coldplate_open`] and is not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_close(handle: *mut Handle) {
    if !handle.is_null() {
        // SAFETY: the handle came out of `Box::into_raw` and is given back once.
        drop(unsafe { Box::from_raw(handle) });
    }
}

/// Number of variables.
///
/// # Safety
/// `handle` is open, or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_variables(handle: *const Handle) -> usize {
    // SAFETY: the caller promises an open handle.
    unsafe { handle.as_ref() }.map_or(0, |own| own.0.variable_count())
}

/// Number of points.
///
/// # Safety
/// `handle` is open, or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_points(handle: *const Handle) -> usize {
    // SAFETY: the caller promises an open handle.
    unsafe { handle.as_ref() }.map_or(0, |own| own.0.point_count())
}

/// Number of limits.
///
/// # Safety
/// `handle` is open, or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_limits(handle: *const Handle) -> usize {
    // SAFETY: the caller promises an open handle.
    unsafe { handle.as_ref() }.map_or(0, |own| own.0.limit_count())
}

/// A variable: name, unit, fitted range.
///
/// # Safety
/// `handle` is open, or null; `out` is null or a place for the answer. The texts last as long as the file's bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_variable(handle: *const Handle, index: usize, out: *mut Entry) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(out)) = (unsafe { handle.as_ref() }, unsafe { out.as_mut() }) else { return NULL };
    let Some(found) = own.0.variable(index) else { return INDEX };
    *out = Entry { name: text(found.name), unit: text(found.unit), low: found.low, high: found.high };
    DONE
}

/// A point: name, unit, and the ends of its 95 % band relative to its value.
///
/// # Safety
/// Requirements of [`coldplate_variable`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_point(handle: *const Handle, index: usize, out: *mut Entry) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(out)) = (unsafe { handle.as_ref() }, unsafe { out.as_mut() }) else { return NULL };
    let Some(found) = own.0.point(index) else { return INDEX };
    *out = Entry { name: text(found.name), unit: text(found.unit), low: -found.half_width, high: found.half_width };
    DONE
}

/// The name of a limit.
///
/// # Safety
/// Requirements of [`coldplate_variable`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_limit_name(handle: *const Handle, index: usize, out: *mut Text) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(out)) = (unsafe { handle.as_ref() }, unsafe { out.as_mut() }) else { return NULL };
    let Some(found) = own.0.limit(index) else { return INDEX };
    *out = text(found.name);
    DONE
}

/// The values of all points.
///
/// # Safety
/// `handle` is open, or null; `x` has `variables` numbers and `values` has `points` places, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_evaluate(
    handle: *const Handle,
    x: *const f64,
    variables: usize,
    values: *mut f64,
    points: usize,
) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(x), Some(values)) =
        (unsafe { handle.as_ref() }, unsafe { numbers(x, variables) }, unsafe { places(values, points) })
    else {
        return NULL;
    };
    if own.0.evaluate(x, values).is_ok() { DONE } else { LENGTH }
}

/// The values of all points at many conditions.
///
/// # Safety
/// `handle` is open, or null; `x` has `variables` numbers for each of `conditions` and `values` has `points` places, or
/// they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_evaluate_batch(
    handle: *const Handle,
    x: *const f64,
    variables: usize,
    values: *mut f64,
    points: usize,
    conditions: usize,
) -> c_int {
    // SAFETY: the caller promises an open handle.
    let Some(own) = (unsafe { handle.as_ref() }) else { return NULL };
    let (Some(numbers_of_x), Some(places_of_values)) = (variables.checked_mul(conditions), points.checked_mul(conditions)) else {
        return LENGTH;
    };
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(x), Some(values)) = (unsafe { numbers(x, numbers_of_x) }, unsafe { places(values, places_of_values) }) else {
        return NULL;
    };
    if (variables, points) != (own.0.variable_count(), own.0.point_count()) {
        return LENGTH;
    }
    if coldplate_batch::evaluate(&own.0, x, values, &mut Box::default()).is_ok() { DONE } else { LENGTH }
}

/// The correction that a controller adds: every displacement with the opposite sign, 0 for other points.
///
/// # Safety
/// Requirements of [`coldplate_evaluate`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_offset(
    handle: *const Handle,
    x: *const f64,
    variables: usize,
    offsets: *mut f64,
    points: usize,
) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(x), Some(offsets)) =
        (unsafe { handle.as_ref() }, unsafe { numbers(x, variables) }, unsafe { places(offsets, points) })
    else {
        return NULL;
    };
    if own.0.offset(x, offsets).is_ok() { DONE } else { LENGTH }
}

/// The derivatives of a point's value along each variable.
///
/// # Safety
/// `handle` is open, or null; `x` has `variables` numbers and `gradient` as many places, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_gradient(
    handle: *const Handle,
    x: *const f64,
    variables: usize,
    point: usize,
    gradient: *mut f64,
) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(x), Some(gradient)) =
        (unsafe { handle.as_ref() }, unsafe { numbers(x, variables) }, unsafe { places(gradient, variables) })
    else {
        return NULL;
    };
    if point >= own.0.point_count() {
        return INDEX;
    }
    if own.0.gradient(x, point, gradient).is_ok() { DONE } else { LENGTH }
}

/// Values, bands, and the verdict at a confidence.
///
/// # Safety
/// Requirements of [`coldplate_evaluate`]; `bands` has `points` places too, and `verdict` is a place for the answer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_assess(
    handle: *const Handle,
    x: *const f64,
    variables: usize,
    confidence: f64,
    values: *mut f64,
    bands: *mut BandRecord,
    points: usize,
    verdict: *mut VerdictRecord,
) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(x), Some(values)) =
        (unsafe { handle.as_ref() }, unsafe { numbers(x, variables) }, unsafe { places(values, points) })
    else {
        return NULL;
    };
    // SAFETY: the caller promises the memory behind these pointers too.
    let (Some(bands), Some(verdict)) = (unsafe { places(bands, points) }, unsafe { verdict.as_mut() }) else { return NULL };
    if !(confidence > 0.5 && confidence < 1.0) {
        return CONFIDENCE;
    }
    let mut found = [Band::default(); coldplate_runtime::format::MAX_POINTS];
    let Some(found) = found.get_mut(..points) else { return LENGTH };
    let Ok(chance) = own.0.assess(x, None, confidence, values, found) else { return LENGTH };
    for (to, from) in bands.iter_mut().zip(found) {
        *to = BandRecord { fit: from.fit.hypot(from.mesh), parameters: from.parameters, misses: from.misses, total: from.total };
    }
    let binding = chance.binding.and_then(|index| c_int::try_from(index).ok()).unwrap_or(-1);
    *verdict =
        VerdictRecord { state: state(chance.state), in_domain: c_int::from(chance.in_domain), binding, probability: chance.probability };
    DONE
}

/// One limit, from the points' values at the condition.
///
/// # Safety
/// Requirements of [`coldplate_evaluate`]; `out` is null or a place for the answer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn coldplate_limit(
    handle: *const Handle,
    index: usize,
    x: *const f64,
    variables: usize,
    values: *const f64,
    points: usize,
    out: *mut LimitRecord,
) -> c_int {
    // SAFETY: the caller promises the memory behind the pointers.
    let (Some(own), Some(x), Some(values)) =
        (unsafe { handle.as_ref() }, unsafe { numbers(x, variables) }, unsafe { numbers(values, points) })
    else {
        return NULL;
    };
    // SAFETY: the caller promises a place for the answer.
    let Some(out) = (unsafe { out.as_mut() }) else { return NULL };
    if x.len() != own.0.variable_count() || values.len() != own.0.point_count() {
        return LENGTH;
    }
    let (Some(found), Some(chance)) = (own.0.limit_value(index, x, values), own.0.limit_chance(index, x, None, values)) else {
        return INDEX;
    };
    let LimitValue { value, low, high, maximum, margin, state: own } = found;
    *out = LimitRecord { value, low, high, maximum, margin, probability: chance.probability, state: state(own) };
    DONE
}

/// Numbers of the caller's; `None` for a null pointer.
///
/// # Safety
/// `data` is null or points to `length` numbers.
unsafe fn numbers<'x>(data: *const f64, length: usize) -> Option<&'x [f64]> {
    // SAFETY: the caller promises `length` numbers.
    if data.is_null() { None } else { Some(unsafe { slice::from_raw_parts(data, length) }) }
}

/// Places of the caller's; `None` for a null pointer.
///
/// # Safety
/// `data` is null or points to `length` places that nobody else uses meanwhile.
unsafe fn places<'x, T>(data: *mut T, length: usize) -> Option<&'x mut [T]> {
    // SAFETY: the caller promises `length` places that nobody else uses.
    if data.is_null() { None } else { Some(unsafe { slice::from_raw_parts_mut(data, length) }) }
}
