//! The functions of the module: each takes a request of a number of bytes, which the host has written to memory from [`allocate`],
//! and returns the address and the length of the answer, which the host reads and gives back to [`release`].

use serde_json::Value;

/// Memory for a number of bytes.
#[unsafe(no_mangle)]
pub extern "C" fn allocate(length: usize) -> *mut u8 {
    Box::into_raw(vec![0u8; length].into_boxed_slice()).cast()
}

/// Gives memory back.
///
/// # Safety
/// The address is that of [`allocate`] or of an answer, with its length, and is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn release(address: *mut u8, length: usize) {
    // SAFETY: both come from a boxed slice of this length.
    drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(address, length)) });
}

/// Calls a function with the request at an address, which is given back. The address of the answer is in the upper 32 bits of
/// the result, its length in the lower ones.
///
/// # Safety
/// As for [`release`].
unsafe fn answer(address: *mut u8, length: usize, function: fn(&str) -> Value) -> u64 {
    // SAFETY: the host wrote the request there.
    let request = unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(address, length)) };
    let answer = function(&String::from_utf8_lossy(&request)).to_string().into_bytes().into_boxed_slice();
    let length = answer.len();
    ((Box::into_raw(answer).cast::<u8>() as usize as u64) << 32) | length as u64
}

/// [`describe`](crate::describe).
///
/// # Safety
/// As for [`release`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn describe(address: *mut u8, length: usize) -> u64 {
    // SAFETY: as is required.
    unsafe { answer(address, length, crate::describe) }
}

/// [`run`](crate::run).
///
/// # Safety
/// As for [`release`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn run(address: *mut u8, length: usize) -> u64 {
    // SAFETY: as is required.
    unsafe { answer(address, length, crate::run) }
}

/// [`cloud`](crate::cloud).
///
/// # Safety
/// As for [`release`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cloud(address: *mut u8, length: usize) -> u64 {
    // SAFETY: as is required.
    unsafe { answer(address, length, crate::cloud) }
}

/// [`check`](crate::check).
///
/// # Safety
/// As for [`release`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn check(address: *mut u8, length: usize) -> u64 {
    // SAFETY: as is required.
    unsafe { answer(address, length, crate::check) }
}

/// Passes the messages of panics to the host, so that they can be reported.
#[unsafe(no_mangle)]
pub extern "C" fn start() {
    std::panic::set_hook(Box::new(|panicked| crate::host::fault(&panicked.to_string())));
}
