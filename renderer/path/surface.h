/* The pass for what is opaque triangles: bases of shells, plain meshes. */
#ifndef PELT_RENDERER_PATH_SURFACE_H
#define PELT_RENDERER_PATH_SURFACE_H

#include "renderer/path/path.h"

struct surface_pass; /* device copies of meshes and their textures */
struct surface_pass *surface_pass_create(void);
void surface_pass_destroy(struct surface_pass *pass); /* takes NULL */

/* Whether an object draws triangles at all. */
bool surface_wanted(const struct scene_object *object);

/* Whether the triangles that it draws take their colour from images. */
bool surface_textured(const struct path_object *object);

/* Brings the meshes that the picture draws to the device. */
enum status surface_pass_upload(struct surface_pass *pass, struct picture *picture,
                                struct error *err);

/* Draws them into picture->target (colour and depth), which is bound. */
enum status surface_pass_draw(struct surface_pass *pass, struct picture *picture,
                              struct error *err);

/* Draws what they throw of shadows into a light's view: shaders/caster_surface.frag. After
 * surface_pass_upload(); depth test and target are the caller's. */
enum status surface_pass_cast(struct surface_pass *pass, struct picture *picture,
                              struct error *err);

#endif
