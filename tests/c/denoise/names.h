/* Names of Vulkan's constants in manifest.json. */
#ifndef NAMES_H
#define NAMES_H

/* The value of a format or descriptor type by its name. Ends the program if the name is not known. */
int vulkan_value(const char *name);

#endif
