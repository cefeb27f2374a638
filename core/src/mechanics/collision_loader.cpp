// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/collision_loader.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>
#include <mutex>
#include <utility>

#include "delassus/error.hpp"
#include "mechanics/collision_setup.hpp"
#include "support/library_location.hpp"

namespace delassus {
namespace {

/// Loads the module once; it stays loaded. A failure is tried again next time.
DelassusCollisionMake load() {
    static std::mutex mutex;
    static DelassusCollisionMake loaded = nullptr;
    const std::lock_guard lock(mutex);
    if (loaded != nullptr) return loaded;
    const std::filesystem::path path = library_directory() / "delassus" / "delassus_collision.so";
    std::error_code error;
    if (!std::filesystem::exists(path, error)) {
        throw InputError(fmt::format(
            "Shapes cannot collide: this build has no FCL ({} is missing); leave the shapes out of the scene.",
            path.string()));
    }
    void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) throw InputError(fmt::format("Shapes cannot collide: {}.", dlerror()));
    loaded = reinterpret_cast<DelassusCollisionMake>(dlsym(handle, "delassus_collision_make"));
    if (loaded == nullptr)
        throw InputError(fmt::format("{} belongs to another version of Delassus; install both anew.", path.string()));
    return loaded;
}

}  // namespace

CollisionDetector::~CollisionDetector() = default;

std::unique_ptr<CollisionDetector> make_collision_detector(CollisionSetup setup) {
    check_collision_setup(setup);
    std::unique_ptr<CollisionDetector> detector;
    load()(std::move(setup), detector);
    return detector;
}

}  // namespace delassus
