// SPDX-License-Identifier: BSD-3-Clause
// Models of robots and mechanisms in the formats of other programs (MJCF, URDF, SDF) as scenes. docs/importing.md says
// what is carried over.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "delassus/export.hpp"

namespace delassus {

/// Something of a model that the scene has not.
struct NotCarriedOver {
    std::string what;  ///< the item: tendon "t", joint "knee"
    std::string why;   ///< what is lost, or what stands in its place
};

struct ImportSettings {
    double end = 10.0;     ///< of the scene, s, > 0
    std::string keyframe;  ///< of an MJCF model, where the scene starts; empty: the model's own start
    /// Controls of MJCF actuators become inputs of the scene (delassus/inputs.hpp), by the names of the actuators.
    bool inputs = false;
    bool floating = false;  ///< the root link of a URDF model moves freely; else the world holds it
    /// The world holds the first body of each mechanism that floats. Refused where none does.
    bool fixed_base = false;
    /// A plane is added, against gravity through the origin, and the model is moved so that its lowest point at the
    /// start is `height` (m) above it. Contacts with it have the friction of the other surface.
    bool ground = false;
    double height = 0.0;
    std::vector<std::filesystem::path> package_paths;  ///< folders in which package:// and model:// are looked for
    std::vector<std::array<std::string, 2>> apart;     ///< names of bodies that never touch, besides the model's
};

/// One item for each kind, with a count and the first names: for people.
[[nodiscard]] DELASSUS_API std::vector<NotCarriedOver> grouped(const std::vector<NotCarriedOver>& all);

/// A scene as text, and the files that it names.
struct ImportedScene {
    std::string format;  ///< MJCF, URDF or SDF
    std::string yaml;
    struct File {
        std::filesystem::path path;  ///< relative to the scene
        std::string content;
    };
    std::vector<File> files;
    int bodies = 0, joints = 0, shapes = 0;
    std::vector<NotCarriedOver> lost;            ///< what acts on the motion
    std::vector<NotCarriedOver> without_effect;  ///< looks, sensors and the like, by kind
};

/// Reads a model. The kind of file follows from its root element: `mujoco`, `robot` or `sdf`. scene: the file that the
/// text is for; paths in the text are relative to its folder. Writes nothing. The text is a scene that read_scene()
/// takes once the files are there. Throws InputError: no such file, not a model, what the format's library says of it,
/// a missing module, or a model without a scene (nothing moves that has mass).
[[nodiscard]] DELASSUS_API ImportedScene import_model(const std::filesystem::path& model,
                                                      const std::filesystem::path& scene,
                                                      const ImportSettings& settings = {});

}  // namespace delassus
