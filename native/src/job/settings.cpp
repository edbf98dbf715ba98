// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/settings.h"

#include "job/error.h"
#include "job/setting_table.h"

namespace raybundle {
namespace {

// The setting of a name, if isOfType(its pointer to a member).
template <class IsOfType>
const Setting& find(const std::string& name, const IsOfType& isOfType) {
    for (const Setting& setting : kSettings)
        if (name == setting.name && std::visit(isOfType, setting.member)) return setting;
    throw invalidArgument("there is no setting \"" + name + "\" of this type");
}

template <class Number>
const Setting& findNumber(const std::string& name) {
    return find(name,
                [](auto member) { return std::is_same_v<ValueOf<decltype(member)>, Number>; });
}

const Setting& findChoice(const std::string& name) {
    return find(name, [](auto member) { return std::is_enum_v<ValueOf<decltype(member)>>; });
}

template <class Number>
Number Settings::*memberOf(const Setting& setting) {
    return std::get<Number Settings::*>(setting.member);
}

template <class Number>
void setNumber(Settings& settings, const std::string& name, Number value) {
    const Setting& setting = findNumber<Number>(name);
    const Number least = Number(setting.least), most = Number(setting.most);
    if (!(value >= least && value <= most))
        throw invalidArgument("setting \"" + name + "\" must lie between " + std::to_string(least) +
                              " and " + std::to_string(most));
    settings.*memberOf<Number>(setting) = value;
}

// Throws if the choice has no value of this name.
template <class Choice>
Choice chosen(const std::string& name, const std::string& value) {
    std::string known;
    for (const auto& row : rowsOf(Choice{})) {
        if (value == row.name) return row.value;
        known += known.empty() ? row.name : std::string(", ") + row.name;
    }
    throw invalidArgument("setting \"" + name + "\" must be one of " + known + ", not \"" + value +
                          "\"");
}

}  // namespace

void Settings::set(const std::string& name, int value) { setNumber(*this, name, value); }

void Settings::set(const std::string& name, float value) { setNumber(*this, name, value); }

void Settings::set(const std::string& name, const std::string& value) {
    std::visit(
        [&](auto member) {
            using Value = ValueOf<decltype(member)>;
            if constexpr (std::is_enum_v<Value>) this->*member = chosen<Value>(name, value);
        },
        findChoice(name).member);
}

void Settings::get(const std::string& name, int& value) const {
    value = this->*memberOf<int>(findNumber<int>(name));
}

void Settings::get(const std::string& name, float& value) const {
    value = this->*memberOf<float>(findNumber<float>(name));
}

const char* Settings::get(const std::string& name) const {
    return std::visit(
        [&](auto member) -> const char* {
            if constexpr (std::is_enum_v<ValueOf<decltype(member)>>)
                return choiceName(this->*member);
            else
                return nullptr;  // no choice, which findChoice() has refused
        },
        findChoice(name).member);
}

}  // namespace raybundle
