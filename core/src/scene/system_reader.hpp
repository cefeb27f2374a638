// SPDX-License-Identifier: BSD-3-Clause
// Reads one system of a scene. Keys are read in the order in which items need one another, whatever their order in the
// file.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "delassus/scene.hpp"
#include "scene/scene_values.hpp"

namespace delassus::scene {

class SystemReader {
public:
    /// Fills result; both outlive the reader.
    SystemReader(const Source& source, SceneSystem& result);

    /// The keys of a system, for the map that holds them.
    [[nodiscard]] std::vector<std::pair<std::string_view, Handler>> handlers();

    /// Builds the system from what the handlers have read. place: the map, for messages about missing keys.
    void build(const YAML::Node& place);

private:
    using Numbers = std::map<std::string, std::int32_t, std::less<>>;
    using ItemReader = void (SystemReader::*)(const YAML::Node& item, const Copy& copy);

    void read_coordinates(const YAML::Node& node);
    void read_integrator(const YAML::Node& node);
    void read_step(const YAML::Node& node);
    void read_tolerance(const YAML::Node& node);
    void read_sleeping(const YAML::Node& node);
    void read_start(const YAML::Node& node);
    void read_limits(const YAML::Node& node);
    /// One step for all, or the control of steps.
    void build_step(const YAML::Node& place);
    void read_materials(const YAML::Node& node);
    void read_material_pair(const YAML::Node& item, const Copy& copy);
    void read_body(const YAML::Node& item, const Copy& copy);
    void read_node(const YAML::Node& item, const Copy& copy);
    void read_elastic_block(const YAML::Node& item, const Copy& copy);
    void read_elastic_mesh(const YAML::Node& item, const Copy& copy);
    void read_cable(const YAML::Node& item, const Copy& copy);
    void read_beam(const YAML::Node& item, const Copy& copy);
    void read_joint(const YAML::Node& item, const Copy& copy);
    using Handlers = std::vector<std::pair<std::string_view, Handler>>;
    /// The keys `damping`, `spring` and `friction`.
    Handlers coordinate_handlers(JointCoordinate& forces);
    void read_motor(const YAML::Node& item, const Copy& copy);
    void read_actuator(const YAML::Node& item, const Copy& copy);
    void read_spring(const YAML::Node& item, const Copy& copy);
    void read_bushing(const YAML::Node& item, const Copy& copy);
    void read_load(const YAML::Node& item, const Copy& copy);
    void read_attachment(const YAML::Node& item, const Copy& copy);
    void read_initial_velocity(const YAML::Node& item, const Copy& copy);
    void read_keep_apart(const YAML::Node& node);

    /// Reads each item of the list, each of its copies.
    /// takes: which items; none: all.
    void read_items(std::string_view key, ItemReader reader, const std::function<bool(const YAML::Node&)>& takes = {});

    struct ShapeOfBody {
        Shape shape;
        std::int32_t material = -1;
        YAML::Node node;
    };
    std::vector<ShapeOfBody> read_shapes(const YAML::Node& node);
    /// Planes and terrain, which have no volume, on a body that moves.
    void refuse_endless_shape(const ShapeOfBody& shape, const std::string& body);
    /// A file's surface as convex shapes, one for each part.
    std::vector<Shape> read_mesh_shapes(const YAML::Node& node);
    Shape read_terrain_shape(const YAML::Node& node);
    Shape read_height_field(const YAML::Node& node);
    /// Keys that elastic blocks and meshes share. Both outlive what is returned.
    template <class Parameters>
    std::vector<std::pair<std::string_view, Handler>> elastic_handlers(Parameters& body,
                                                                       std::optional<std::int32_t>& modes);
    /// Refuses a body that is reduced to modes where the system has what it cannot.
    void note_modes(const YAML::Node& item);
    Shape read_shape_kind(const YAML::Node& item, std::string_view kind, const YAML::Node& node);
    ContactMaterial read_contact_material(const YAML::Node& node, std::string_view name,
                                          std::vector<std::pair<std::string_view, Handler>> more = {});

    /// Refuses a name that is not among the numbers: "key" verb "name", but there is no such kind.
    std::int32_t number_of(const YAML::Node& node, std::string_view key, std::string_view verb, const std::string& name,
                           std::string_view kind, const Numbers& numbers);
    std::int32_t node_named(const YAML::Node& node, std::string_view key, const Copy& copy);
    /// Its place in elastic_.
    std::int32_t elastic_named(const YAML::Node& node, std::string_view key, const Copy& copy);
    AlignedBox read_box(const YAML::Node& node, std::string_view what);
    /// The keys `elastic`, `face` and `box` of a load or an attachment.
    struct SideKeys {
        YAML::Node elastic{YAML::NodeType::Undefined}, face{YAML::NodeType::Undefined}, box{YAML::NodeType::Undefined};
    };
    struct Elastic;
    const Elastic& elastic_of(const SideKeys& keys, const Copy& copy);
    /// The box of `box`, or the slab of `face`. what: the item.
    AlignedBox box_named(const YAML::Node& item, const Elastic& body, const SideKeys& keys, std::string_view what);
    std::vector<NodeShare> sides_named(const YAML::Node& item, const SideKeys& keys, const Copy& copy);
    std::int32_t material_named(const YAML::Node& node, std::string_view key);
    /// Also "world".
    BodyIndex body_named(const YAML::Node& node, std::string_view key, const Copy& copy);
    /// −1 if the joint was left out.
    std::int32_t joint_named(const YAML::Node& node, std::string_view key, const Copy& copy);
    BodyMotion read_body_motion(const YAML::Node& node, const Copy& copy);
    /// A list of three motions.
    std::array<Motion, 3> three_motions(const YAML::Node& node, std::string_view key, Inputs* inputs);
    /// Whether forces can move the body.
    [[nodiscard]] bool moves(BodyIndex body) const;
    /// Why what acts between these two bodies, neither of which forces can move, has no effect.
    [[nodiscard]] std::string no_effect(BodyIndex first, BodyIndex second) const;
    [[nodiscard]] Vector3 position(BodyIndex body) const;
    /// Notes the name, or refuses it if there is one already.
    void take_name(const YAML::Node& node, Numbers& numbers, std::string_view kind, const std::string& name,
                   std::int32_t number);

    /// Adds the place to an InputError whose sentence names none.
    template <class Action>
    auto at(const YAML::Node& node, Action&& action) {
        try {
            return action();
        } catch (const InputError& error) {
            source_.refuse(node, error.what());
        }
    }

    const Source& source_;
    SceneSystem& result_;
    std::map<std::string, YAML::Node, std::less<>> lists_;
    /// Of each elastic block or mesh, by the number in blocks_.
    struct Elastic {
        std::int32_t first = 0, nodes = 0;
        std::optional<AlignedBox> box;  ///< of a block
    };
    std::vector<Elastic> elastic_;
    Numbers bodies_, nodes_, blocks_, joints_, materials_, others_;
    std::optional<Vector3> gravity_;
    std::optional<double> envelope_, step_, end_;
    YAML::Node step_node_{YAML::NodeType::Undefined};
    bool tolerance_ = false;
    StepControl control_;
    std::optional<double> initial_;
};

}  // namespace delassus::scene
