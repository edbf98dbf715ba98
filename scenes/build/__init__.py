"""One module per scene, each with a function ``build(context)`` that fills an empty file."""
