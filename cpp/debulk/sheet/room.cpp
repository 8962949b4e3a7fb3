// Placeholder while the house is being set up; the room's first source replaces it.
