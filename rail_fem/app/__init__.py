"""The app: what the light models say at once while the scene is changed in a browser on this machine."""
