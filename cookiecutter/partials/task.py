{% if cookiecutter.example == "wheeled" %}
{{ plain("my_drive.py", "my_drive", cookiecutter.__task) -}}
{% else %}
{{ plain("my_reach.py", "my_reach", cookiecutter.__task) -}}
{% endif %}
