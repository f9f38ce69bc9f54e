#pragma once

/// The names of the Inverse protocol, each once: those who read messages and those who write them
/// use these.
namespace tpm::haptics::inverse_key {

inline constexpr const char *device = "inverse3", *id = "device_id", *config = "config",
                            *state = "state", *commands = "commands", *configure = "configure",
                            *session = "session", *session_id = "session_id",
                            *force = "set_cursor_force", *place = "set_cursor_position",
                            *position = "position", *cursor_position = "cursor_position",
                            *cursor_velocity = "cursor_velocity",
                            *cursor_force = "current_cursor_force", *gate = "force_gate",
                            *gain = "gain", *damping = "damping", *scalar = "scalar",
                            *vector = "vector", *values = "values", *profile = "profile",
                            *name = "name", *simulated = "simulated_device",
                            *orientation = "orientation", *buttons = "buttons",
                            *version = "project_version", *filters = "filters",
                            *handedness = "handedness", *preset = "preset", *basis = "basis",
                            *permutation = "permutation", *mount = "mount", *rotation = "rotation",
                            *scale = "scale", *gravity = "gravity_compensation",
                            *enabled = "enabled", *factor = "scaling_factor",
                            *torque = "torque_scaling", *set_buttons = "set_buttons",
                            *status = "status", *in_use = "in_use", *mode = "control_mode",
                            *probe = "probe_position";
inline constexpr const char* grips[] = {"wireless_verse_grip", "verse_grip", "custom_verse_grip"};
inline constexpr const char* button_names[][2] = {
    {"a", "button_0"}, {"b", "button_1"}, {"c", "button_2"}};
inline constexpr const char* simulated_words = "SIMULATED DEVICE";

}  // namespace tpm::haptics::inverse_key
