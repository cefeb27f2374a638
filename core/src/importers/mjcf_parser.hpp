// SPDX-License-Identifier: BSD-3-Clause
// From the elements of a file to a Spec: sections, classes of defaults, frames, replicas and attached models.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "importers/mjcf_spec.hpp"

namespace delassus::importers::mjcf {

/// What all files of a model share.
struct Building {
    Spec spec;
    model_import::Model& model;
    /// Suffixes of the replicas of a name that itself is none.
    std::map<std::string, std::vector<std::string>> replicas;
    std::map<std::string, std::shared_ptr<const Mesh>> meshes;  ///< by name
    std::map<std::string, std::size_t> height_fields;
    std::map<std::string, std::map<std::string, std::int32_t>> taken;  ///< names by kinds
    bool names_are_lost = false;                                       ///< something was left out that has names
    std::size_t made = 0;                                              ///< bodies, geoms, joints
};

/// One file, the first or one that is attached.
class Parser {
public:
    /// prefix, suffix: of every name. depth: of attachments. All outlive the parser.
    Parser(const XmlElement& root, std::filesystem::path folder, std::string prefix, std::string suffix, int depth,
           Building& building);

    /// The whole first model.
    void read_all();
    /// What the world of this file has, or one body or frame of it, goes to `body` at the frame; then what refers to
    /// it.
    void attach(const std::string& body_name, const std::string& frame_name, std::int32_t body, const Frame& frame,
                const XmlElement& by);

private:
    struct Scope {
        std::int32_t body = 0;
        Frame frame = Frame::Identity();
        const Defaults* defaults = nullptr;
        std::string suffix;
    };

    void read_settings();
    void read_defaults(const XmlElement& element, const Defaults& parent, bool top);
    void read_assets(const XmlElement& element);
    void read_mesh_asset(const XmlElement& element);
    void read_height_field_asset(const XmlElement& element);
    void read_children(const XmlElement& element, const Scope& scope);
    void read_body(const XmlElement& element, const Scope& scope, const Defaults& defaults);
    void read_joint_of(const XmlElement& element, const Scope& scope, const Defaults& defaults);
    void read_geom_of(const XmlElement& element, const Scope& scope, const Defaults& defaults);
    void read_site_of(const XmlElement& element, const Scope& scope, const Defaults& defaults);
    void read_replicas(const XmlElement& element, const Scope& scope, const Defaults& defaults);
    void read_attachment(const XmlElement& element, const Scope& scope);
    void read_references(bool attached);
    void read_contacts(const XmlElement& section, bool attached);
    void read_key(const XmlElement& element);
    /// Runs once, or once for each replica of the names that the attributes have. f gets the suffix.
    void for_each_replica(const XmlElement& element, std::initializer_list<const char*> attributes,
                          const std::function<void(const std::string&)>& f);
    /// prefix + name + suffix; empty stays empty.
    [[nodiscard]] std::string full(const std::string& name, const std::string& suffix) const;
    [[nodiscard]] std::string referred(const std::string& name, const std::string& suffix) const;
    /// Of the element's class, or else `otherwise`.
    [[nodiscard]] const Defaults& defaults_of(const XmlElement& element, const Defaults& otherwise) const;
    [[nodiscard]] const Defaults& child_defaults_of(const XmlElement& element, const Defaults& otherwise) const;
    /// Notes a name, or makes one; refuses one that is there.
    void take(const XmlElement& element, const char* kind, std::string& name, const std::string& suffix,
              std::int32_t number);
    /// The same of a name that is complete; an empty one is none.
    void take_alone(const XmlElement& element, const char* kind, const std::string& name, std::int32_t number = 0);
    [[nodiscard]] bool is_taken(const char* kind, const std::string& name) const;
    void count(const XmlElement& element);
    /// Elements and attributes that nobody read.
    void note_unread(const XmlElement& element);
    [[nodiscard]] std::filesystem::path asset(const XmlElement& element, const std::string& folder) const;

    const XmlElement& root_;
    std::filesystem::path folder_;
    std::string prefix_, suffix_;
    int depth_;
    Building& building_;
    Spec& spec_;
    std::size_t compiler_number_;
    Compiler compiler_;
    std::map<std::string, Defaults> classes_;
    std::map<std::string, const XmlElement*> models_;  // to attach
    std::set<const XmlElement*> attaching_;
};

}  // namespace delassus::importers::mjcf
