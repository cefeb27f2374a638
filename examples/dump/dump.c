/* SPDX-License-Identifier: BSD-3-Clause
 *
 * Two blocks of 1 kg, one on the other on the ground, pushed sideways for a step of 0.01 s, written as a problem
 * folder:
 *
 *     cc -std=c99 dump.c $(pkg-config --cflags delassus) -lm -o dump
 *     ./dump two_blocks && delassus compare two_blocks
 */
#include <delassus/dump.h>

int main(int argc, char** argv) {
    const double step = 0.01, gravity = 9.81, push = 7.0;
    /* The velocities of the lower block (along, across, up), then those of the upper one. Contact frames: up first. */
    const int diagonal[] = {0, 1, 2, 3, 4, 5};
    const double mass[] = {1, 1, 1, 1, 1, 1};
    const double D[6][6] = {{0, 0, 1, 0, 0, 0},  {1, 0, 0, 0, 0, 0},  {0, 1, 0, 0, 0, 0},   /* ground, lower */
                            {0, 0, -1, 0, 0, 1}, {-1, 0, 0, 1, 0, 0}, {0, -1, 0, 0, 1, 0}}; /* lower, upper */
    const double a[] = {0, 0, -step * gravity, step * push, 0, -step * gravity};
    const delassus_dump_cone cones[] = {{DELASSUS_DUMP_FRICTION, 3, 0.3, NULL, NULL},
                                        {DELASSUS_DUMP_FRICTION, 3, 0.5, NULL, NULL}};
    delassus_dump_problem problem = {0};
    char message[256];
    problem.n = 6;
    problem.m = 6;
    problem.coulomb = 1;
    problem.H = delassus_dump_triplets(6, diagonal, diagonal, mass);
    problem.D = delassus_dump_dense(&D[0][0], 6);
    problem.a = a;
    problem.cones = cones;
    problem.cone_count = 2;
    problem.source = "examples/dump/dump.c";
    if (delassus_dump(argc > 1 ? argv[1] : "two_blocks", &problem, message, sizeof message) == 0) return 0;
    fprintf(stderr, "%s\n", message);
    return 2;
}
