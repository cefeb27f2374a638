// SPDX-License-Identifier: BSD-3-Clause
// A model as the text of a scene.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "delassus/error.hpp"
#include "delassus/mesh_files.hpp"
#include "delassus/version.hpp"
#include "model_import/model.hpp"
#include "scene/joint_kinds.hpp"

namespace delassus::model_import {
namespace {

/// Longer lists of points and heights go to files of their own.
constexpr std::size_t most_points = 32, most_heights = 400;

using Output = fmt::memory_buffer;
template <class... Values>
void put(Output& out, fmt::format_string<Values...> text, Values&&... values) {
    fmt::format_to(std::back_inserter(out), text, std::forward<Values>(values)...);
}

/// With all digits that tell it from its neighbours. YAML wants a point before an exponent.
std::string number(double x) {
    if (x == 0.0) return "0";
    std::string text = fmt::format("{}", x);
    if (const auto e = text.find('e'); e != std::string::npos && text.find('.') == std::string::npos)
        text.insert(e, ".0");
    return text;
}

std::string list(const Vector3d& v) {
    return fmt::format("[{}, {}, {}]", number(v.x()), number(v.y()), number(v.z()));
}

/// Without what rounding leaves of sums of this size.
double cleaned(double x, double size) {
    return std::abs(x) <= 2e-15 * size ? 0.0 : x;
}

Quaterniond cleaned(Quaterniond q) {
    for (double& x : q.coeffs()) x = cleaned(x, 1.0);
    return q;
}

std::string list(const Quaterniond& given) {
    Quaterniond q = given.normalized();
    if (q.w() < 0.0) q.coeffs() *= -1.0;
    return fmt::format("[{}, {}, {}, {}]", number(q.w()), number(q.x()), number(q.y()), number(q.z()));
}

bool is_turned(const Quaterniond& q) {
    return q.vec().squaredNorm() > 0.0;
}

std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        if (static_cast<unsigned char>(c) < 0x20) {
            result += fmt::format("\\x{:02x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
        } else {
            result += c;
        }
    }
    return result + "\"";
}

/// On one line, for a comment.
std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
    return text;
}

/// For names of files: letters, digits, _ and -.
std::string plain(const std::string& name) {
    std::string result;
    for (const char c : name) {
        const bool keeps = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
        result += keeps ? c : '_';
    }
    return result.empty() ? "mesh" : result;
}

class Writer {
public:
    Writer(const Model& model, std::filesystem::path scene, ImportedScene& result)
        : model_(model), scene_(std::move(scene)), result_(result) {}

    void write(const std::filesystem::path& model_file, const ImportSettings& settings) {
        put_head(model_file);
        if (!model_.title.empty()) put(out_, "title: {}\n", quoted(model_.title));
        put(out_, "step: {}\nend: {}\ngravity: {}\n", number(model_.step), number(settings.end), list(model_.gravity));
        put_materials();
        put(out_, "bodies:\n");
        for (const ModelBody& body : model_.bodies) put_body(body);
        put_joints();
        put_forces();
        if (!model_.apart.empty()) {
            put(out_, "keep_apart:\n");
            for (const auto& [a, b] : model_.apart) put(out_, "  - [{}, {}]\n", body_name(a), body_name(b));
        }
        result_.yaml = fmt::to_string(out_);
        result_.bodies = static_cast<int>(model_.bodies.size());
        result_.joints = static_cast<int>(model_.joints.size());
    }

private:
    [[nodiscard]] std::string body_name(std::int32_t body) const {
        return body < 0 ? "world" : quoted(model_.bodies[static_cast<std::size_t>(body)].name);
    }
    [[nodiscard]] const JointParameters& joint(std::int32_t index) const {
        return model_.joints[static_cast<std::size_t>(index)].parameters;
    }

    void put_head(const std::filesystem::path& model_file) {
        put(out_, "# From {} ({}) by delassus {} import.\n", one_line(model_file.filename().string()), result_.format,
            DELASSUS_VERSION);
        const auto items = [&](const char* title, const std::vector<NotCarriedOver>& all) {
            if (all.empty()) return;
            put(out_, "# {}:\n", title);
            for (const auto& one : grouped(all)) put(out_, "#   {}: {}\n", one_line(one.what), one_line(one.why));
        };
        items("Not carried over", model_.lost);
        items("Left out, without effect on the motion", model_.without_effect);
    }

    void put_materials() {
        std::vector<char> used(model_.materials.size(), 0);
        for (const ModelBody& body : model_.bodies)
            for (const ModelShape& shape : body.shapes)
                if (shape.material >= 0) used[static_cast<std::size_t>(shape.material)] = 1;
        if (std::find(used.begin(), used.end(), 1) == used.end()) return;
        const auto surface = [](const auto& one) {
            std::string text = "friction: " + number(one.friction);
            if (one.restitution > 0.0) text += ", restitution: " + number(one.restitution);
            return text;
        };
        put(out_, "materials:\n");
        for (std::size_t k = 0; k < used.size(); ++k)
            if (used[k] != 0)
                put(out_, "  {}: {{{}}}\n", quoted(model_.materials[k].name), surface(model_.materials[k]));
        bool first = true;
        for (const ModelMaterialPair& pair : model_.material_pairs) {
            const auto a = static_cast<std::size_t>(pair.first), b = static_cast<std::size_t>(pair.second);
            if (used[a] == 0 || used[b] == 0) continue;
            if (!pair.touch) {
                if (std::exchange(first, false)) put(out_, "material_pairs:\n");
                put(out_, "  - {{first: {}, second: {}, touch: false}}\n", quoted(model_.materials[a].name),
                    quoted(model_.materials[b].name));
                continue;
            }
            const double mean = std::sqrt(model_.materials[a].friction * model_.materials[b].friction);
            const double restitution = std::max(model_.materials[a].restitution, model_.materials[b].restitution);
            if (std::abs(mean - pair.friction) <= 1e-15 * mean && restitution == pair.restitution) continue;
            if (std::exchange(first, false)) put(out_, "material_pairs:\n");
            put(out_, "  - {{first: {}, second: {}, {}}}\n", quoted(model_.materials[a].name),
                quoted(model_.materials[b].name), surface(pair));
        }
    }

    void put_body(const ModelBody& body) {
        put(out_, "  - name: {}\n", quoted(body.name));
        if (body.fixed) {
            put(out_, "    fixed: true\n");
        } else if (body.mass == 0.0) {
            put(out_, "    massless: true\n");
        } else {
            const Matrix3d& J = body.inertia;
            put(out_, "    mass: {}\n    inertia: {{xx: {}, yy: {}, zz: {}", number(body.mass), number(J(0, 0)),
                number(J(1, 1)), number(J(2, 2)));
            const auto beside = [&](const char* key, double given) {
                if (const double value = cleaned(given, J.trace()); value != 0.0)
                    put(out_, ", {}: {}", key, number(value));
            };
            beside("xy", 0.5 * (J(0, 1) + J(1, 0)));
            beside("xz", 0.5 * (J(0, 2) + J(2, 0)));
            beside("yz", 0.5 * (J(1, 2) + J(2, 1)));
            put(out_, "}}\n");
        }
        put(out_, "    position: {}\n", list(body.position));
        if (is_turned(body.orientation)) put(out_, "    orientation: {}\n", list(body.orientation));
        if (!body.velocity.isZero(0.0)) put(out_, "    velocity: {}\n", list(body.velocity));
        if (!body.angular_velocity.isZero(0.0)) put(out_, "    angular_velocity: {}\n", list(body.angular_velocity));
        if (body.shapes.empty()) return;
        put(out_, "    shapes:\n");
        for (const ModelShape& shape : body.shapes) {
            put(out_, "      - {{{}", form(shape));
            const Quaterniond to_body = body.orientation.conjugate();
            const double size = 1.0 + shape.position.norm();
            const Vector3d place =
                (to_body * (shape.position - body.position)).unaryExpr([&](double x) { return cleaned(x, size); });
            if (!place.isZero(0.0)) put(out_, ", position: {}", list(place));
            if (const Quaterniond turned = cleaned(to_body * shape.orientation); is_turned(turned))
                put(out_, ", orientation: {}", list(turned));
            if (shape.material >= 0)
                put(out_, ", material: {}", quoted(model_.materials[static_cast<std::size_t>(shape.material)].name));
            put(out_, "}}\n");
            ++result_.shapes;
        }
    }

    std::string form(const ModelShape& shape) {
        const auto long_one = [&](const char* kind) {
            return fmt::format("{}: {{radius: {}, length: {}}}", kind, number(shape.size.x()), number(shape.size.y()));
        };
        switch (shape.form) {
            case Form::Sphere:
                return fmt::format("sphere: {{radius: {}}}", number(shape.size.x()));
            case Form::Box:
                return fmt::format("box: {{size: {}}}", list(shape.size));
            case Form::Capsule:
                return long_one("capsule");
            case Form::Cylinder:
                return long_one("cylinder");
            case Form::Plane:
                return "plane: {}";
            case Form::Hull:
                return hull(shape);
            case Form::MeshFile: {
                const auto near = std::filesystem::absolute(scene_).parent_path();
                const auto file = std::filesystem::proximate(shape.file, near).generic_string();
                if (shape.scale == 1.0) return fmt::format("mesh: {}", quoted(file));
                return fmt::format("mesh: {{file: {}, scale: {}}}", quoted(file), number(shape.scale));
            }
            case Form::HeightField:
                return heights(shape);
        }
        return {};
    }

    std::string hull(const ModelShape& shape) {
        if (shape.points.size() > most_points && !shape.triangles.empty()) {
            Mesh mesh;
            for (const Vector3d& point : shape.points) mesh.vertices.push_back(array(point));
            mesh.triangles = shape.triangles;
            if (is_closed(mesh)) {
                Output obj;
                for (const auto& v : mesh.vertices) put(obj, "v {} {} {}\n", v[0], v[1], v[2]);
                for (const auto& t : mesh.triangles) put(obj, "f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
                return fmt::format("mesh: {}", quoted(file(shape.name, ".obj", fmt::to_string(obj))));
            }
        }
        std::string points;
        for (const Vector3d& point : shape.points) points += (points.empty() ? "" : ", ") + list(point);
        return fmt::format("convex: {{points: [{}]}}", points);
    }

    static bool is_closed(const Mesh& mesh) {
        try {
            check_closed_surface(mesh, "hull");
            return true;
        } catch (const InputError&) {
            return false;
        }
    }

    std::string heights(const ModelShape& shape) {
        const auto columns = static_cast<std::size_t>(shape.columns);
        const auto row_of = [&](std::size_t row, const char* between) {
            std::string text;
            for (std::size_t k = 0; k < columns; ++k)
                text.append(k == 0 ? "" : between).append(number(shape.heights[row * columns + k]));
            return text;
        };
        const auto rows = static_cast<std::size_t>(shape.rows);
        std::string all;
        if (shape.heights.size() <= most_heights) {
            for (std::size_t row = 0; row < rows; ++row)
                all += fmt::format("{}[{}]", row == 0 ? "" : ", ", row_of(row, ", "));
            all = fmt::format("heights: [{}]", all);
        } else {
            for (std::size_t row = 0; row < rows; ++row) all += row_of(row, " ") + "\n";
            all = "file: " + quoted(file(shape.name, ".txt", all));
        }
        return fmt::format("height_field: {{size: [{}, {}], {}}}", number(shape.size.x()), number(shape.size.y()), all);
    }

    /// Beside the scene; the same content is one file.
    std::string file(const std::string& name, const char* extension, std::string content) {
        const auto [known, added] = files_.try_emplace(content, "");
        if (!added) return known->second;
        const std::string folder = plain(scene_.stem().string()) + "_meshes/";
        std::string path = folder + plain(name) + extension;
        for (int k = 2; taken(path); ++k) path = fmt::format("{}{}_{}{}", folder, plain(name), k, extension);
        known->second = path;
        result_.files.push_back({path, std::move(content)});
        return path;
    }
    [[nodiscard]] bool taken(const std::string& path) const {
        return std::any_of(result_.files.begin(), result_.files.end(),
                           [&](const ImportedScene::File& one) { return one.path == path; });
    }

    void put_joints() {
        if (model_.joints.empty()) return;
        put(out_, "joints:\n");
        for (const ModelJoint& one : model_.joints) {
            const JointParameters& own = one.parameters;
            const auto kind = scene::joint_kinds[static_cast<std::size_t>(own.kind)].first;
            put(out_, "  - {{name: {}, kind: {}", quoted(own.name), kind);
            if (own.kind == JointKind::Gear) {
                put(out_, ", gear_first: {}, gear_second: {}, gear_ratio: {}}}\n", quoted(joint(own.gear_first).name),
                    quoted(joint(own.gear_second).name), number(own.gear_ratio));
                continue;
            }
            put(out_, ", first: {}, second: {}, point: {}", body_name(own.first), body_name(own.second),
                list(Eigen::Map<const Vector3d>(own.point.data())));
            if (own.kind != JointKind::Spherical && own.kind != JointKind::Fixed)
                put(out_, ", axis: {}", list(Eigen::Map<const Vector3d>(own.axis.data())));
            if (own.kind == JointKind::Universal)
                put(out_, ", second_axis: {}", list(Eigen::Map<const Vector3d>(own.second_axis.data())));
            if (std::isfinite(own.lower)) put(out_, ", lower: {}", number(own.lower));
            if (std::isfinite(own.upper)) put(out_, ", upper: {}", number(own.upper));
            put_coordinate(own.kind == JointKind::Prismatic ? own.slide : own.turn);
            put(out_, "}}\n");
        }
    }

    void put_coordinate(const JointCoordinate& c) {
        const auto value = [&](const char* key, double x) {
            if (x != 0.0) put(out_, ", {}: {}", key, number(x));
        };
        value("damping", c.damping);
        if (c.stiffness > 0.0) {
            put(out_, ", spring: {{stiffness: {}", number(c.stiffness));
            value("rest", c.rest);
            put(out_, "}}");
        }
        value("friction", c.friction);
        value("armature", c.armature);
        value("start", c.start.value_or(0.0));
        value("start_rate", c.start_rate.value_or(0.0));
    }

    void put_forces() {
        if (!model_.locks.empty()) put(out_, "motors:\n");
        for (const ModelLock& lock : model_.locks)
            put(out_, "  - {{name: {}, joint: {}, motion: {}}}\n", quoted(lock.name), quoted(joint(lock.joint).name),
                number(lock.position));
        if (!model_.actuators.empty()) put(out_, "actuators:\n");
        for (const ModelActuator& one : model_.actuators) {
            put(out_, "  - {{name: {}, joint: {}", quoted(one.name), quoted(joint(one.joint).name));
            if (one.position) put(out_, ", position: {}", motion(*one.position, one.input, 1.0));
            if (one.speed) put(out_, ", speed: {}", motion(*one.speed, one.input, 1.0));
            if (one.kp > 0.0) put(out_, ", kp: {}", number(one.kp));
            if (one.kd > 0.0) put(out_, ", kd: {}", number(one.kd));
            if (std::isfinite(one.limit)) put(out_, ", limit: {}", number(one.limit));
            put(out_, "}}\n");
        }
        if (model_.drives.empty()) return;
        put(out_, "loads:\n");
        for (const ModelDrive& drive : model_.drives) {
            const JointParameters& own = joint(drive.joint);
            put_drive(own, own.second, drive, 1.0, drive.name);
            put_drive(own, own.first, drive, -1.0, drive.name + " (reaction)");
        }
    }

    // The axis stays where it is in both bodies, and what a slide is pushed with lies on one line.
    void put_drive(const JointParameters& own, std::int32_t body, const ModelDrive& drive, double sign,
                   const std::string& name) {
        if (body < 0 || model_.bodies[static_cast<std::size_t>(body)].fixed) return;
        const Vector3d axis = model_.bodies[static_cast<std::size_t>(body)].orientation.conjugate() *
                              Eigen::Map<const Vector3d>(own.axis.data()).normalized();
        const auto along = [&](int i) { return motion(drive.force * sign * axis[i], drive.input, sign * axis[i]); };
        put(out_, "  - {{name: {}, body: {}, follower: true, {}: [{}, {}, {}]", quoted(name), body_name(body),
            own.kind == JointKind::Prismatic ? "force" : "torque", along(0), along(1), along(2));
        if (own.kind == JointKind::Prismatic)
            put(out_, ", point: {}", list(Eigen::Map<const Vector3d>(own.point.data())));
        put(out_, "}}\n");
    }

    /// What is constant without an input, or a factor times the input.
    static std::string motion(double constant, const std::optional<ModelInput>& input, double factor) {
        if (!input) return number(constant);
        if (factor == 0.0) return "0";
        std::string text = fmt::format("{{input: {{name: {}", quoted(input->name));
        if (const double scale = factor * input->scale; scale != 1.0) text += ", scale: " + number(scale);
        if (input->offset != 0.0) text += ", offset: " + number(factor * input->offset);
        if (input->start != 0.0) text += ", start: " + number(input->start);
        if (input->range)
            text += fmt::format(", range: [{}, {}]", number((*input->range)[0]), number((*input->range)[1]));
        return text + "}}";
    }

    const Model& model_;
    std::filesystem::path scene_;
    ImportedScene& result_;
    Output out_;
    std::map<std::string, std::string> files_;  // by content
};

}  // namespace

void write_scene(const Model& model, const std::filesystem::path& model_file, const std::filesystem::path& scene,
                 const ImportSettings& settings, ImportedScene& result) {
    Writer(model, scene, result).write(model_file, settings);
    result.lost = model.lost;
    result.without_effect = model.without_effect;
}

}  // namespace delassus::model_import
