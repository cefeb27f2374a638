// SPDX-License-Identifier: BSD-3-Clause
// What libsdformat made of an SDF file as a Model.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <sdf/sdf.hh>
#include <string>
#include <vector>

#include "model_import/model.hpp"

namespace delassus::importers {

class SdfReader {
public:
    /// Both outlive the reader.
    SdfReader(const std::filesystem::path& file, model_import::Model& model) : file_(file), model_(model) {}
    void read(const sdf::Root& root);

private:
    using Placed = Eigen::Isometry3d;

    void read_world(const sdf::World& world);
    /// name: with those of the models around it. links: of the outermost model, to be kept apart.
    void read_model(const sdf::Model& given, const Placed& around, const std::string& name, bool fixed,
                    std::vector<std::int32_t>& links);
    void read_link(const sdf::Link& link, const Placed& model, const std::string& name, bool fixed,
                   std::vector<std::int32_t>& links);
    void read_shape(const sdf::Collision& collision, const Placed& link, const std::string& what, bool fixed,
                    model_import::ModelBody& body);
    [[nodiscard]] std::int32_t material_of(const sdf::Collision& collision, const std::string& what);
    void read_joint(const sdf::Joint& joint, const Placed& model, const std::string& scope);
    /// joint_element: for what only the element has; null: nothing.
    void read_coordinate(const sdf::JointAxis& axis, const sdf::ElementPtr& joint_element, const std::string& what,
                         JointParameters& result);
    void read_bitmasks();
    void note_plugins(const sdf::ElementPtr& element, const std::string& of, bool acts);

    std::filesystem::path file_;
    model_import::Model& model_;
    model_import::Names body_names_, joint_names_;
    std::map<std::string, std::int32_t> links_;  // by the full name
    struct Mask {
        std::int32_t body;
        std::uint16_t bits;
    };
    std::vector<Mask> masks_;        // of shapes
    std::vector<std::string> seen_;  // lights, sensors, visuals
    std::vector<std::string> efforts_;
};

}  // namespace delassus::importers
