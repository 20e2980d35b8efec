"""Images of an arm and of tissue that is cut: colours, depth, and what each pixel shows.

film           the pictures of a film
film_files     films as files
force_panel    a plot beside a film
image_files    images as files
camera         a camera of a simulation, or of a model and tissue of your own
theatre        what cameras see: a model, its data, and the tissue beside it
tissue_parts   the surface of a body as textured meshes, one for each label
viewpoints     where cameras are: those of the scene and of the model, and two that are always there
identities     numbers that say what a pixel shows
canvas         draws a MuJoCo model, and triangle meshes that change, into arrays
composition    the scene that is drawn: the model, and those meshes in it
render_model   the second model of a canvas, which has room for those meshes
finishes       looks of meshes: pictures, colours, gloss
lenses         from where to where is seen
lights         lamps
gl_context     OpenGL without a screen
"""
