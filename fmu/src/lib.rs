//! The C interface of FMI 3.0 for co-simulation: from pointers to [`FmuInstance`] and back.
//!
//! This crate is the exception to the rule that nothing here is unsafe: pointers of a C program cannot be checked. It decides
//! nothing; what flies is in crate `lab-fmu` and below. A panic ends at the interface with `fmi3Fatal`.
//!
//! The contract of every function is that of the standard: an instance is one that `fmi3InstantiateCoSimulation` gave and
//! `fmi3FreeInstance` has not taken yet, used by one thread at a time, and an array has as many elements as the number beside it
//! says.

#![expect(unsafe_code, reason = "an interface of C takes pointers")]
#![expect(clippy::missing_safety_doc, reason = "the contract above is that of all of them")]

use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::ptr;

use host_io::problem::{Problem, problem};
use lab_fmu::description::LOG_CATEGORY;
use lab_fmu::{FmuInstance, FmuValue, SideSetup};

/// What a function says.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    Ok = 0,
    Error = 3,
    Fatal = 4,
}

/// Where messages go.
pub type LogMessage =
    Option<unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char)>;

/// What an importer holds: an instance, and what belongs to its interface.
#[derive(Debug)]
struct Component {
    instance: FmuInstance,
    log: Log,
    /// Texts that the importer was given; the standard lets them live until the next call.
    texts: Vec<CString>,
}

#[derive(Debug, Clone, Copy)]
struct Log {
    message: LogMessage,
    environment: *mut c_void,
}

impl Log {
    /// Tells the importer the reason.
    fn say(&self, status: Status, reason: &str) -> Status {
        let Some(message) = self.message else { return status };
        let [category, reason] = [LOG_CATEGORY, reason]
            .map(|text| CString::new(text.replace('\0', " ")).unwrap_or_default());
        // SAFETY: the importer gave function and environment for this, and both texts outlive the call.
        unsafe { message(self.environment, status, category.as_ptr(), reason.as_ptr()) };
        status
    }
}

/// Acts on the component of an importer; tells the reason of an error.
///
/// # Safety
///
/// The contract of the interface holds for `instance`.
unsafe fn act(
    instance: *mut c_void,
    act: impl FnOnce(&mut Component) -> Result<(), Problem>,
) -> Status {
    // SAFETY: by the contract it is null or a live component that nobody else uses.
    let Some(component) = (unsafe { instance.cast::<Component>().as_mut() }) else {
        return Status::Error;
    };
    let log = component.log;
    match catch_unwind(AssertUnwindSafe(|| act(component))) {
        Ok(Ok(())) => Status::Ok,
        Ok(Err(reason)) => log.say(Status::Error, &reason.to_string()),
        Err(_) => {
            log.say(Status::Fatal, "a defect of the program; its text is on the standard error")
        }
    }
}

/// # Safety
///
/// `first` is null, or so many elements live there for as long as the slice.
unsafe fn slice<'a, T>(first: *const T, count: usize) -> &'a [T] {
    // SAFETY: by the contract; a slice must not begin at null.
    if first.is_null() { &[] } else { unsafe { std::slice::from_raw_parts(first, count) } }
}

/// # Safety
///
/// As for `slice`, and nobody else uses the elements.
unsafe fn slice_mut<'a, T>(first: *mut T, count: usize) -> &'a mut [T] {
    // SAFETY: by the contract; a slice must not begin at null.
    if first.is_null() { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(first, count) } }
}

/// # Safety
///
/// `text` is null or ends with a zero.
unsafe fn text(text: *const c_char) -> Result<String, Problem> {
    if text.is_null() {
        return Err(problem!("a text is missing"));
    }
    // SAFETY: by the contract it ends with a zero.
    Ok(unsafe { CStr::from_ptr(text) }.to_str()?.to_owned())
}

fn same_count(references: &[u32], values: usize) -> Result<(), Problem> {
    match references.len() == values {
        true => Ok(()),
        false => Err(problem!("{} variables and {values} values", references.len())),
    }
}

/// Function of a type that the variables have.
macro_rules! access {
    ($get:ident, $set:ident, $type:ty, $variant:ident, $of:expr) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            instance: *mut c_void,
            references: *const u32,
            count: usize,
            values: *mut $type,
            values_count: usize,
        ) -> Status {
            // SAFETY: the contract of the interface.
            unsafe {
                act(instance, |component| {
                    let (references, values) =
                        (slice(references, count), slice_mut(values, values_count));
                    same_count(references, values.len())?;
                    for (reference, place) in references.iter().zip(values) {
                        match component.instance.get(*reference)? {
                            FmuValue::$variant(value) => *place = (*value).into(),
                            _ => return Err(problem!("variable {reference} has another type")),
                        }
                    }
                    Ok(())
                })
            }
        }

        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            instance: *mut c_void,
            references: *const u32,
            count: usize,
            values: *const $type,
            values_count: usize,
        ) -> Status {
            // SAFETY: the contract of the interface.
            unsafe {
                act(instance, |component| {
                    let (references, values) =
                        (slice(references, count), slice(values, values_count));
                    same_count(references, values.len())?;
                    let of: fn($type) -> _ = $of;
                    for (reference, value) in references.iter().zip(values) {
                        component.instance.set(*reference, FmuValue::$variant(of(*value)))?;
                    }
                    Ok(())
                })
            }
        }
    };
}

access!(fmi3GetFloat64, fmi3SetFloat64, f64, Number, |value| value);
access!(fmi3GetUInt64, fmi3SetUInt64, u64, Count, |value| value);
// A byte, because a C program may hand over one that is no `bool`.
access!(fmi3GetBoolean, fmi3SetBoolean, u8, Flag, |value| value != 0);

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetString(
    instance: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut *const c_char,
    values_count: usize,
) -> Status {
    // SAFETY: the contract of the interface.
    unsafe {
        act(instance, |component| {
            let (references, values) = (slice(references, count), slice_mut(values, values_count));
            same_count(references, values.len())?;
            component.texts.clear();
            for reference in references {
                match component.instance.get(*reference)? {
                    FmuValue::Text(text) => component.texts.push(CString::new(text.as_str())?),
                    _ => return Err(problem!("variable {reference} has another type")),
                }
            }
            for (place, text) in values.iter_mut().zip(&component.texts) {
                *place = text.as_ptr();
            }
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetString(
    instance: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const *const c_char,
    values_count: usize,
) -> Status {
    // SAFETY: the contract of the interface.
    unsafe {
        act(instance, |component| {
            let (references, values) = (slice(references, count), slice(values, values_count));
            same_count(references, values.len())?;
            for (reference, value) in references.iter().zip(values) {
                component.instance.set(*reference, FmuValue::Text(text(*value)?))?;
            }
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: u8,
    _logs: u8,
    uses_events: u8,
    _may_return_early: u8,
    _intermediate: *const u32,
    intermediate_count: usize,
    environment: *mut c_void,
    message: LogMessage,
    _intermediate_update: *const c_void,
) -> *mut c_void {
    let log = Log { message, environment };
    let make = || {
        // SAFETY: the contract of the interface.
        let (token, resources) = unsafe { (text(token)?, text(resources)?) };
        if uses_events != 0 || intermediate_count > 0 {
            return Err(problem!("this FMU has no event mode and no intermediate variables"));
        }
        FmuInstance::new(SideSetup::read(Path::new(&resources), &token)?)
    };
    match catch_unwind(make) {
        Ok(Ok(instance)) => {
            Box::into_raw(Box::new(Component { instance, log, texts: Vec::new() })).cast()
        }
        Ok(Err(reason)) => {
            let _ = log.say(Status::Error, &reason.to_string());
            ptr::null_mut()
        }
        Err(_) => ptr::null_mut(),
    }
}

/// This FMU is for co-simulation alone.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange(
    _name: *const c_char,
    _token: *const c_char,
    _resources: *const c_char,
    _visible: u8,
    _logs: u8,
    _environment: *mut c_void,
    _message: LogMessage,
) -> *mut c_void {
    ptr::null_mut()
}

/// This FMU is for co-simulation alone.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution(
    _name: *const c_char,
    _token: *const c_char,
    _resources: *const c_char,
    _visible: u8,
    _logs: u8,
    _environment: *mut c_void,
    _message: LogMessage,
    _clock_update: *const c_void,
    _lock: *const c_void,
    _unlock: *const c_void,
) -> *mut c_void {
    ptr::null_mut()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(instance: *mut c_void) {
    if !instance.is_null() {
        // SAFETY: by the contract it came from `into_raw` and is given back once.
        drop(unsafe { Box::from_raw(instance.cast::<Component>()) });
    }
}

/// Errors are always reported, and there is nothing else to report.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetDebugLogging(
    _instance: *mut c_void,
    _on: u8,
    _count: usize,
    _categories: *const *const c_char,
) -> Status {
    Status::Ok
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    instance: *mut c_void,
    _has_tolerance: u8,
    _tolerance: f64,
    start_s: f64,
    _has_stop: u8,
    _stop_s: f64,
) -> Status {
    // SAFETY: the contract of the interface.
    unsafe { act(instance, |component| component.instance.enter_initialization(start_s)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ExitInitializationMode(instance: *mut c_void) -> Status {
    // SAFETY: the contract of the interface.
    unsafe { act(instance, |component| component.instance.exit_initialization()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Terminate(instance: *mut c_void) -> Status {
    // SAFETY: the contract of the interface.
    unsafe { act(instance, |component| component.instance.terminate()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Reset(instance: *mut c_void) -> Status {
    let reset = |component: &mut Component| {
        component.instance.reset();
        Ok(())
    };
    // SAFETY: the contract of the interface.
    unsafe { act(instance, reset) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: *mut c_void,
    point_s: f64,
    size_s: f64,
    _no_state_before: u8,
    event_needed: *mut u8,
    terminate: *mut u8,
    early_return: *mut u8,
    last_time_s: *mut f64,
) -> Status {
    // SAFETY: the contract of the interface; each place is null or takes one value.
    unsafe {
        act(instance, |component| {
            let stepped = component.instance.step(point_s, size_s);
            let over = matches!(stepped, Ok(true));
            for (place, flag) in [(event_needed, false), (terminate, over), (early_return, false)] {
                if let Some(place) = place.as_mut() {
                    *place = flag.into();
                }
            }
            if let Some(place) = last_time_s.as_mut() {
                *place = component.instance.now_s();
            }
            stepped.map(drop)
        })
    }
}

/// A state is a copy of the instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(instance: *mut c_void, state: *mut *mut c_void) -> Status {
    // SAFETY: the contract of the interface; `state` has null or a state of this function.
    unsafe {
        act(instance, |component| {
            let place = state.as_mut().ok_or_else(|| problem!("no place for a state"))?;
            match place.cast::<FmuInstance>().as_mut() {
                Some(old) => old.clone_from(&component.instance),
                None => *place = Box::into_raw(Box::new(component.instance.clone())).cast(),
            }
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(instance: *mut c_void, state: *mut c_void) -> Status {
    // SAFETY: the contract of the interface; `state` is one of `fmi3GetFMUState`.
    unsafe {
        act(instance, |component| {
            let state = state.cast::<FmuInstance>().as_ref();
            component.instance.clone_from(state.ok_or_else(|| problem!("no state"))?);
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(
    instance: *mut c_void,
    state: *mut *mut c_void,
) -> Status {
    // SAFETY: the contract of the interface; `state` has null or a state of `fmi3GetFMUState`, given back once.
    unsafe {
        act(instance, |_| {
            if let Some(place) = state.as_mut().filter(|place| !place.is_null()) {
                drop(Box::from_raw(place.cast::<FmuInstance>()));
                *place = ptr::null_mut();
            }
            Ok(())
        })
    }
}

/// Functions of what this FMU does not have: importers look for all of the standard. With the types of their further arguments.
macro_rules! lacking {
    ($($name:ident($($type:ty),*);)+) => {
        $(#[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(instance: *mut c_void, $(_: $type),*) -> Status {
            // SAFETY: the contract of the interface.
            unsafe { act(instance, |_| Err(problem!("this FMU has no {}", stringify!($name)))) }
        })+
    };
}

type References = *const u32;
type Place = *mut c_void;
type Source = *const c_void;

lacking! {
    fmi3GetFloat32(References, usize, Place, usize);
    fmi3GetInt8(References, usize, Place, usize);
    fmi3GetUInt8(References, usize, Place, usize);
    fmi3GetInt16(References, usize, Place, usize);
    fmi3GetUInt16(References, usize, Place, usize);
    fmi3GetInt32(References, usize, Place, usize);
    fmi3GetUInt32(References, usize, Place, usize);
    fmi3GetInt64(References, usize, Place, usize);
    fmi3GetBinary(References, usize, Place, Place, usize);
    fmi3GetClock(References, usize, Place);
    fmi3SetFloat32(References, usize, Source, usize);
    fmi3SetInt8(References, usize, Source, usize);
    fmi3SetUInt8(References, usize, Source, usize);
    fmi3SetInt16(References, usize, Source, usize);
    fmi3SetUInt16(References, usize, Source, usize);
    fmi3SetInt32(References, usize, Source, usize);
    fmi3SetUInt32(References, usize, Source, usize);
    fmi3SetInt64(References, usize, Source, usize);
    fmi3SetBinary(References, usize, Source, Source, usize);
    fmi3SetClock(References, usize, Source);
    fmi3GetNumberOfVariableDependencies(u32, Place);
    fmi3GetVariableDependencies(u32, Place, Place, Place, Place, usize);
    fmi3SerializedFMUStateSize(Place, Place);
    fmi3SerializeFMUState(Place, Place, usize);
    fmi3DeserializeFMUState(Source, usize, Place);
    fmi3GetDirectionalDerivative(References, usize, References, usize, Source, usize, Place, usize);
    fmi3GetAdjointDerivative(References, usize, References, usize, Source, usize, Place, usize);
    fmi3EnterConfigurationMode();
    fmi3ExitConfigurationMode();
    fmi3GetIntervalDecimal(References, usize, Place, Place);
    fmi3GetIntervalFraction(References, usize, Place, Place, Place);
    fmi3GetShiftDecimal(References, usize, Place);
    fmi3GetShiftFraction(References, usize, Place, Place);
    fmi3SetIntervalDecimal(References, usize, Source);
    fmi3SetIntervalFraction(References, usize, Source, Source);
    fmi3SetShiftDecimal(References, usize, Source);
    fmi3SetShiftFraction(References, usize, Source, Source);
    fmi3EvaluateDiscreteStates();
    fmi3UpdateDiscreteStates(Place, Place, Place, Place, Place, Place);
    fmi3EnterEventMode();
    fmi3EnterStepMode();
    fmi3GetOutputDerivatives(References, usize, Source, Place, usize);
    fmi3ActivateModelPartition(u32, f64);
    fmi3EnterContinuousTimeMode();
    fmi3CompletedIntegratorStep(u8, Place, Place);
    fmi3SetTime(f64);
    fmi3SetContinuousStates(Source, usize);
    fmi3GetContinuousStateDerivatives(Place, usize);
    fmi3GetEventIndicators(Place, usize);
    fmi3GetContinuousStates(Place, usize);
    fmi3GetNominalsOfContinuousStates(Place, usize);
    fmi3GetNumberOfEventIndicators(Place);
    fmi3GetNumberOfContinuousStates(Place);
}
