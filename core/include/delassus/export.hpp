// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Marks what libdelassus exports; everything else in it is hidden.
#define DELASSUS_API __attribute__((visibility("default")))
