/* SPDX-License-Identifier: BSD-3-Clause */
/* Contact forces of Delassus in a program of MuJoCo, in C:
 *
 *     delassus_mujoco* contact = delassus_mujoco_create(NULL, message, sizeof message);
 *     …
 *     delassus_step(model, data, contact);        // was: mj_step(model, data);
 *
 * README.md beside this file says which problem is solved. Needs MuJoCo 2.2.2 or later. */
#ifndef DELASSUS_MUJOCO_H
#define DELASSUS_MUJOCO_H

#include <mujoco/mujoco.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A solver and what it remembers of the last step. Belongs to one mjData at a time, and to one thread at a time. */
typedef struct delassus_mujoco delassus_mujoco;

/* What is zero or null takes its default. */
typedef struct delassus_mujoco_options {
    const char*
        solver; /* as --solver of the command has it, "ssn" or "pgs(omega=1.2)"; "ssn", then "auto" if that fails */
    const char*
        contacts;     /* "hard": rigid, at the velocities of the step's end; "mujoco": MuJoCo's compliance; "hard" */
    const char* law;  /* "coulomb", or "associated": the convex law that MuJoCo itself solves; "coulomb" */
    double tolerance; /* natural error (docs/errors.md) that is asked for; 1e-9 */
    double loosest;   /* natural error above which a step fails; 1e-6 */
} delassus_mujoco_options;

/* Of the last step. */
typedef struct delassus_mujoco_report {
    int rows;             /* of the problem; 0: nothing was to be solved */
    int contacts;         /* that had rows of their own */
    int solves;           /* more than one where torsional or rolling friction, or the integrator, needs them */
    int remembered;       /* blocks of rows that started from the forces of the step before */
    long long iterations; /* of the solver, in all solves */
    double natural_error; /* as Delassus measures it; above `loosest`, up to its root, only where the bounds of
                             torsional and rolling friction did not settle */
    double seconds;       /* from posing the problem to writing the forces back */
} delassus_mujoco_report;

/* options may be null. Null where an option is wrong or the solver is not found, with one sentence in message, which
 * holds size bytes. The caller frees it. */
delassus_mujoco* delassus_mujoco_create(const delassus_mujoco_options* options, char* message, size_t size);
void delassus_mujoco_free(delassus_mujoco* contact); /* may be null */

/* In place of mj_step: integrators Euler, implicit and implicitfast. 0, or −1 where the step could not be done, with
 * the reason in delassus_mujoco_message: qpos, qvel, act and time are then those from before. */
int delassus_step(const mjModel* model, mjData* data, delassus_mujoco* contact);

/* In place of mj_forward: efc_force, qfrc_constraint, qacc and sensors, without integration. Hard contacts depend on
 * the step that would follow. */
int delassus_forward(const mjModel* model, mjData* data, delassus_mujoco* contact);

/* The sentence of the last failure; empty if there was none. Lasts until the next call. */
const char* delassus_mujoco_message(const delassus_mujoco* contact);
delassus_mujoco_report delassus_mujoco_last(const delassus_mujoco* contact);
/* Forgets the forces of the last step, as after mj_resetData. */
void delassus_mujoco_forget(delassus_mujoco* contact);

#ifdef __cplusplus
}
#endif

#endif
