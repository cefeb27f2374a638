// SPDX-License-Identifier: BSD-3-Clause
// What takes seconds to compile is declared in a header of the SDK and defined beside it, in *_bodies.hpp. These are
// inline and come with the declarations, so a plugin needs no library. A project of many files may compile them once:
// all its files define DELASSUS_SDK_COMPILED, and one of them includes the bodies (core/src/sdk).
#pragma once

#ifdef DELASSUS_SDK_COMPILED
#define DELASSUS_SDK_FUNCTION
#else
#define DELASSUS_SDK_FUNCTION inline
#endif
