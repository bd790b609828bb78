"""What reference flights without the gap say of the model, and how well it is known then."""
