// SPDX-License-Identifier: BSD-3-Clause
//
// The solver of ../plugin-c in Rust without crates: bilateral rows of a reduced problem, E λ = −b, by Gaussian
// elimination. The structs are those of delassus/plugin.h, as far as they are used; bindgen can make all of them.
//
//     rustc --edition 2021 --crate-type cdylib -O -C panic=abort dense.rs -o dense_rust.so
//     delassus plugins describe ./dense_rust.so --sidecar
//     delassus plugins check ./dense_rust.so
use std::ffi::{c_char, c_void};
use std::slice::{from_raw_parts, from_raw_parts_mut};

macro_rules! text {
    ($text:literal) => {
        concat!($text, "\0").as_ptr() as *const c_char
    };
}

const SOLVED: i32 = 0;
const NUMERICAL_FAILURE: i32 = 5;

#[repr(C)]
struct Matrix {
    rows: i32,
    columns: i32,
    entries: i32,
    row_start: *const i32,
    column: *const i32,
    value: *const f64,
}

/// The beginning of delassus_problem: only the host makes one.
#[repr(C)]
pub struct Problem {
    struct_size: u32,
    law: i32,
    n: i32,
    m: i32,
    h: Matrix,
    d: Matrix,
    e: Matrix,
    a: *const f64,
    b: *const f64,
}

/// The beginning of delassus_outcome.
#[repr(C)]
pub struct Outcome {
    struct_size: u32,
    status: i32,
    iterations: i64,
    analyses: i64,
    factorizations: i64,
    residual: f64,
    message: *const c_char,
}

type Setup = extern "C" fn(*mut Dense, *const Problem) -> i32;

#[repr(C)]
pub struct Descriptor {
    magic: u32,
    abi_major: u16,
    abi_minor: u16,
    struct_size: u32,
    flags: u32,
    name: *const c_char,
    version: *const c_char,
    description: *const c_char,
    licence: *const c_char,
    capabilities: u64,
    options: *const c_void,
    option_count: i32,
    reserved: i32,
    create: extern "C" fn(*const c_void, i32, *mut *mut Dense) -> i32,
    destroy: extern "C" fn(*mut Dense),
    analyze: Setup,
    factorize: Setup,
    solve: extern "C" fn(*mut Dense, *const Problem, *const c_void, *mut f64, *mut f64, *mut Outcome) -> i32,
    last_error: extern "C" fn(*const Dense) -> *const c_char,
    optional: [*const c_void; 5], // accepts, use_team, and those of problems in parts
    build: u32,
    reserved_2: u32,
}
unsafe impl Sync for Descriptor {} // it points at constants

#[derive(Default)]
pub struct Dense {
    rows: Vec<Vec<f64>>, // L below the diagonal, U on it and above
    pivot: Vec<usize>,
    factorizations: i64,
    singular: bool,
}

impl Dense {
    fn factorize(&mut self, rows: Vec<Vec<f64>>) -> bool {
        let m = rows.len();
        self.rows = rows;
        self.pivot.clear();
        for k in 0..m {
            let largest = (k..m).fold(k, |best, i| if self.rows[i][k].abs() > self.rows[best][k].abs() { i } else { best });
            if self.rows[largest][k] == 0.0 {
                return false;
            }
            self.pivot.push(largest);
            self.rows.swap(k, largest);
            let (above, below) = self.rows.split_at_mut(k + 1);
            for row in below {
                row[k] /= above[k][k];
                for j in k + 1..m {
                    row[j] -= row[k] * above[k][j];
                }
            }
        }
        self.factorizations += 1;
        true
    }

    fn solve(&self, v: &mut [f64]) {
        let m = v.len();
        for (k, &row) in self.pivot.iter().enumerate() {
            v.swap(k, row);
        }
        for i in 0..m {
            v[i] -= (0..i).map(|j| self.rows[i][j] * v[j]).sum::<f64>();
        }
        for i in (0..m).rev() {
            v[i] = (v[i] - (i + 1..m).map(|j| self.rows[i][j] * v[j]).sum::<f64>()) / self.rows[i][i];
        }
    }
}

extern "C" fn create(_: *const c_void, _: i32, solver: *mut *mut Dense) -> i32 {
    unsafe { *solver = Box::into_raw(Box::default()) };
    SOLVED
}

extern "C" fn destroy(solver: *mut Dense) {
    drop(unsafe { Box::from_raw(solver) });
}

extern "C" fn analyze(_: *mut Dense, _: *const Problem) -> i32 {
    SOLVED
}

extern "C" fn factorize(solver: *mut Dense, problem: *const Problem) -> i32 {
    let (solver, e) = unsafe { (&mut *solver, &(*problem).e) };
    let m = e.rows as usize;
    let start = unsafe { from_raw_parts(e.row_start, m + 1) };
    let mut rows = vec![vec![0.0; m]; m];
    for (i, row) in rows.iter_mut().enumerate() {
        for k in start[i] as usize..start[i + 1] as usize {
            unsafe { row[*e.column.add(k) as usize] = *e.value.add(k) };
        }
    }
    solver.singular = !solver.factorize(rows);
    if solver.singular { NUMERICAL_FAILURE } else { SOLVED }
}

extern "C" fn solve(solver: *mut Dense, problem: *const Problem, _: *const c_void, _: *mut f64, lambda: *mut f64,
                    outcome: *mut Outcome) -> i32 {
    let (solver, problem, outcome) = unsafe { (&*solver, &*problem, &mut *outcome) };
    if problem.m > 0 {
        let m = problem.m as usize;
        let (lambda, b) = unsafe { (from_raw_parts_mut(lambda, m), from_raw_parts(problem.b, m)) };
        for (l, b) in lambda.iter_mut().zip(b) {
            *l = -b;
        }
        solver.solve(lambda);
    }
    outcome.status = SOLVED;
    outcome.iterations = 0;
    outcome.analyses = 0;
    outcome.factorizations = solver.factorizations;
    outcome.residual = f64::NAN;
    outcome.message = std::ptr::null();
    SOLVED
}

extern "C" fn last_error(solver: *const Dense) -> *const c_char {
    match unsafe { solver.as_ref() } {
        Some(solver) if solver.singular => text!("E is singular"),
        _ => text!(""),
    }
}

static DESCRIPTOR: Descriptor = Descriptor {
    magic: 0x53414c44,
    abi_major: 2,
    abi_minor: 6,
    struct_size: std::mem::size_of::<Descriptor>() as u32,
    flags: 0,
    name: text!("dense_rust"),
    version: text!("1.0.0"),
    description: text!("Gaussian elimination of a reduced problem: an example in Rust"),
    licence: text!("BSD-3-Clause"),
    capabilities: 1 | 1 << 30, // DELASSUS_CAN_FREE | DELASSUS_CAN_REDUCED
    options: std::ptr::null(),
    option_count: 0,
    reserved: 0,
    create,
    destroy,
    analyze,
    factorize,
    solve,
    last_error,
    optional: [std::ptr::null(); 5],
    build: if cfg!(debug_assertions) { 2 } else { 1 }, // whether it was optimised: -O turns debug assertions off
    reserved_2: 0,
};

#[no_mangle]
pub extern "C" fn delassus_plugin() -> *const Descriptor {
    &DESCRIPTOR
}
